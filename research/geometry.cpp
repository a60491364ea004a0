// The paper's four panels: tubes in position space, without data and with them.
#include <cmath>
#include <string>
#include <vector>

#include "forereach/certify/tube.h"
#include "forereach/sets/zonogon.h"
#include "research/evaluate.h"
#include "research/experiment.h"

namespace forereach::research {
namespace {

constexpr int kMostScenarios = 100, kRolloutsShown = 80;

struct Panel {
  const System& system;
  Group group;
  Scenario scenario;
  Answer ours, global;
  Rollouts target;

  [[nodiscard]] std::string name() const { return system.name + "_" + NameOf(group); }
};

// The first plan of seed 0 that shows what the panel is for: in B one that the target spoils and global calibration
// certifies, in C one that ForeReach certifies; else the last that was looked at.
Panel FindPanel(const System& system, Group group) {
  const Transitions data = MakeData(system, Layout::kCorridor, 0, system.sample_sizes.back(), 0);
  const Declaration declaration{system.deployed, Eigen::VectorXd::Zero(system.num_states())};
  const Setting setting{*system.model, system.domain, declaration, data, 0};
  const auto envelope = Methods()[0].make(setting), calibrated = Methods()[1].make(setting);
  const Evaluator ours(system, *envelope, 5), global(system, *calibrated, 5);
  for (int i = group == Group::kB ? 1 : 0;; i += 2) {
    const Scenario scenario = MakeScenario(system, group, 0, i);
    Panel panel{system, group, scenario, {}, {}, Rollouts(system, scenario, kRolloutsShown)};
    ours.Certify(scenario, panel.ours);
    global.Certify(scenario, panel.global);
    const Outcome wanted = (group == Group::kB ? panel.global : panel.ours).decision.outcome;
    if (wanted == Outcome::kCertified || i + 2 >= kMostScenarios) return panel;
  }
}

std::vector<Panel> Panels() {
  std::vector<Panel> panels;
  for (const System* system : Systems())
    for (const Group group : {Group::kB, Group::kC}) panels.push_back(FindPanel(*system, group));
  return panels;
}

std::vector<Table> GeometryTables(const Results&) {
  Table table{"Tube geometry",
              "One plan a panel, the largest N, seed 0; 1 is yes. In B a plan that global calibration certifies and "
              "the target spoils, in C one that ForeReach certifies. The paper shows these as pictures.",
              {}};
  for (const Panel& panel : Panels()) {
    const auto row = [&](const char* what, bool is_so) { table.Add(panel.name() + ": " + what, is_so, 0); };
    row("global calibration certifies", panel.global.decision.outcome == Outcome::kCertified);
    row("its tube contains the target", Cover(panel.global, panel.target) == Membership::kInside);
    row("ForeReach certifies", panel.ours.decision.outcome == Outcome::kCertified);
    row("its tube, as far as it goes, contains the target", Cover(panel.ours, panel.target) == Membership::kInside);
    row("the target stays clear of the obstacle", panel.target.StayClearOf(panel.scenario.obstacle));
  }
  return {table};
}

std::string Slices(const Answer& answer) {
  std::string lines;
  for (int t = 0; t <= answer.tube.length(); ++t) {
    const Zonotope& slice = answer.tube.slice(t);
    const std::vector<Eigen::Vector2d> corners =
        Outline(Zonotope(slice.CenterVector().head(2), slice.GeneratorMatrix().topRows(2)));
    for (const Eigen::Vector2d& corner : corners) lines += DataLine({corner.x(), corner.y()});
    lines += DataLine({corners[0].x(), corners[0].y()}) + "\n";
  }
  return lines;
}

// "x y step" at the center of every third slice, for labels; of the last, with D where the tube ends before the plan.
std::string Steps(const Answer& answer, int horizon) {
  std::string lines;
  for (int t = 0; t <= answer.tube.length(); ++t) {
    const bool is_last = t == answer.tube.length();
    if (t % 3 != 0 && !is_last) continue;
    const Eigen::VectorXd center = answer.tube.slice(t).CenterVector();
    const bool is_exit = is_last && t < horizon;
    lines += DataLine({center[0], center[1]});
    lines.back() = ' ';
    lines += (is_exit ? "\"D at " : "\"") + std::to_string(t) + "\"\n";
  }
  return lines;
}

std::string Paths(const Rollouts& target) {
  std::string lines;
  for (int i = 0; i < target.count(); ++i) {
    for (int t = 0; t <= target.horizon(); ++t) lines += DataLine({target.state(i, t)[0], target.state(i, t)[1]});
    lines += "\n";
  }
  return lines;
}

std::vector<Plot> GeometryPlots(const Results&) {
  Plot plot{"geometry",
            "Tubes in position space, metres: left without data near the plan, right with them; above the point mass, "
            "below the bicycle. Numbers are steps, at the center of ForeReach's slices; a cross and D: the tube leaves "
            "the certification domain there and ends.",
            900, 760, ""};
  const std::vector<Panel> panels = Panels();
  for (const Panel& panel : panels) {
    plot.script += DataBlock(panel.name() + "_ours", Slices(panel.ours));
    plot.script += DataBlock(panel.name() + "_global", Slices(panel.global));
    plot.script += DataBlock(panel.name() + "_target", Paths(panel.target));
    plot.script += DataBlock(panel.name() + "_steps", Steps(panel.ours, panel.system.horizon));
    const Zonotope& last = panel.ours.tube.slice(panel.ours.tube.length());
    const bool exits = panel.ours.tube.length() < panel.system.horizon;
    plot.script +=
        DataBlock(panel.name() + "_exit", DataLine({exits ? last.center(0) : NAN, exits ? last.center(1) : NAN}));
    const Circle& circle = panel.scenario.obstacle;
    plot.script +=
        DataBlock(panel.name() + "_obstacle", DataLine({circle.center.x(), circle.center.y(), circle.radius}));
  }
  plot.script +=
      "set multiplot layout 2,2 title \"\\n\\n\"\nset size ratio -1\nset offsets 0.3, 0.3, 0.6, 0.6\n"
      "set style fill transparent solid 0.25\n";
  for (const Panel& panel : panels) {
    const std::string name = std::string(1, '$').append(panel.name());
    plot.script += "set title '" + std::string(&panel.system == &PointMassSystem() ? "Point mass" : "Bicycle") +
                   (panel.group == Group::kB ? ", no data near the plan" : ", data along the plan") + "'\n";
    plot.script += &panel == &panels.front()
                       ? "set key at screen 0.5, 0.985 center top horizontal maxcols 6 samplen 1.5 width -1\n"
                       : "unset key\n";
    plot.script += "set xlabel 'x, m'; set ylabel 'y, m'\n";
    plot.script += "plot " + name + "_target with lines lw 0.3 lc rgb '#b0b0b0' title 'target', " + name +
                   "_ours with filledcurves closed lc rgb green title 'ForeReach', " + name +
                   "_ours with lines lw 0.7 lc rgb green notitle, " + name +
                   "_global with lines lw 1 lc rgb blue title 'global calibration', " + name +
                   "_ours every :::0::0 with lines lw 1.8 lc rgb '#222222' title 'X_0', " + name +
                   "_steps using 1:2:3 with labels offset 0,1.1 font ',9' textcolor rgb '#222222' notitle, " + name +
                   "_exit with points pt 2 ps 1.3 lw 2 lc rgb purple title 'ends: domain left', " + name +
                   "_obstacle with circles fs transparent solid 0.6 lc rgb red title 'obstacle'\n";
  }
  plot.script += "unset multiplot\n";
  return {plot};
}

}  // namespace

Experiment TubeGeometry() {
  return {"geometry", "tubes in position space, the paper's four panels", {}, GeometryTables, GeometryPlots};
}

}  // namespace forereach::research
