#include "records/report.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <deque>
#include <iterator>
#include <map>
#include <optional>
#include <ostream>
#include <set>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "forereach/candidate_plan_t.hpp"
#include "forereach/execution_event_t.hpp"
#include "forereach/numerics/parallel.h"
#include "forereach/robot_state_t.hpp"
#include "lcmtypes/printable.h"
#include "records/log_tasks.h"
#include "records/outlines.h"
#include "records/recorded_case.h"
#include "records/run_logs.h"
#include "records/shadow.h"
#include "task/json_text.h"

namespace forereach {
namespace {

constexpr double kBetweenBodies = 4;  // metres of the path from one drawn body to the next

// At most kMost of what is added, at even distances.
template <class What>
struct Thinned {
  static constexpr std::size_t kMost = 1 << 15;

  void Add(What what) {
    if (count++ % stride != 0) return;
    all.push_back(std::move(what));
    if (all.size() < kMost) return;
    for (std::size_t i = 0; i < kMost / 2; ++i) all[i] = std::move(all[2 * i]);
    all.resize(kMost / 2);
    stride *= 2;
  }

  std::vector<What> all;
  std::size_t count = 0, stride = 1;
};

class PictureMaker final : public TimelineUser, CaseJudge {
 public:
  explicit PictureMaker(const BusOptions& channels) : CaseJudge(AllCores()), channels_(channels) {}

  void OnStart(const Config& task) override {
    now_ = &task;
    if (const auto dim = task.problem->projection.rows(); dim != 2)
      throw PictureError(fmt::format("picture: the safety coordinates have to be planar, not of dimension {}", dim));
  }
  void OnReload(const Config& task) override { OnStart(task); }

  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& decision = recorded.decision;
    const bool is_drawn = decision.outcome == decision_t::CERTIFIED || decision.outcome == decision_t::ABSTAIN_SAFETY;
    if (!recorded.candidate || !is_drawn) return;
    RecordedCase judged = CaseOf(recorded);
    if (!judged.candidate) return;
    if (!judged.missing.empty()) {
      ++result_.disagreements;
      return;
    }
    const bool is_certified = decision.outcome == decision_t::CERTIFIED;
    std::deque<RecordedCase>& kind = is_certified ? certified_ : abstained_;
    if (is_certified) executed_.try_emplace(decision.plan_id);
    obstacles_.Add(*judged.basis.obstacles);
    kind.push_back(std::move(judged));
    while (kind.size() > LogPicture::kMostTubes || (obstacles_.AreTooMany() && kind.size() > 1)) {
      if (is_certified) executed_.erase(kind.front().decision.plan_id);
      obstacles_.Remove(*kind.front().basis.obstacles);
      kind.pop_front();
      ++result_.earlier;
    }
  }

  void OnEvent(const LogEvent& event) override {
    if (event.channel == channels_.robot_state) {
      if (const auto state = Decoded<robot_state_t>(event.message())) AddState(*state);
    } else if (event.channel == channels_.event) {
      if (const auto execution = Decoded<execution_event_t>(event.message())) AddExecution(*execution);
    }
  }

  // @param last whose goal is drawn.
  LogPicture Finish(const Timeline& timeline, const Config& last) {
    outlines_.resize(certified_.size() + abstained_.size());
    std::size_t place = 0;
    for (std::deque<RecordedCase>* kind : {&certified_, &abstained_})
      for (; !kind->empty(); kind->pop_front()) Put(kind->front(), place++);
    CertifyAgain();
    Picture& picture = result_.picture;
    picture.path = std::move(path_.all);
    picture.stops = std::move(stops_.all);
    for (auto& body : bodies_.all) std::ranges::move(body, std::back_inserter(picture.bodies));
    const std::vector<double>& goal = last.planner.goal;
    if (goal.size() == 2) picture.goal = Picture::Circle{{goal[0], goal[1]}, last.planner.goal_radius};
    for (auto& [plan_id, tube] : tubes_)
      for (std::size_t t = 0; t < tube.size(); ++t)
        std::ranges::move(tube[t],
                          std::back_inserter(executed_[plan_id].contains(static_cast<int>(t)) ? picture.executed
                                                                                              : picture.certified));
    picture.obstacles = timeline.logged_obstacles();
    return std::move(result_);
  }

 private:
  void Refuse(const JudgedCandidate&, const std::string&) override { ++result_.disagreements; }
  void Look(const JudgedCandidate& judged, const Certifier& certifier, const Decision& again,
            const Tube& tube) override {
    if (judged.IsAnsweredBy(again))
      outlines_[judged.place] =
          Sweeps(certifier, tube, again.outcome == Outcome::kCertified ? tube.length() : again.step);
  }
  // Leaves out those whose answer is not the recorded one.
  void Take(const JudgedCandidate& judged) override {
    auto outlines = std::exchange(outlines_[judged.place], {});
    if (outlines.empty())
      ++result_.disagreements;
    else if (judged.outcome == decision_t::CERTIFIED)
      tubes_[judged.candidate.plan_id] = std::move(outlines);
    else
      result_.picture.abstained.push_back(Joined(std::move(outlines)));
  }

  // The last one is where it was found unsafe: with several parts, the last of them.
  static std::vector<Picture::Polygon> Joined(std::vector<std::vector<Picture::Polygon>> tube) {
    std::vector<Picture::Polygon> joined;
    for (auto& unit : tube) std::ranges::move(unit, std::back_inserter(joined));
    return joined;
  }

  std::optional<Eigen::Vector2d> PositionOf(const double* state, int num_states) const {
    if (num_states != now_->problem->model->num_states()) return std::nullopt;
    return now_->problem->projection * Eigen::Map<const Eigen::VectorXd>(state, num_states);
  }

  void AddState(const robot_state_t& message) {
    const auto position = PositionOf(message.state, message.num_states);
    if (!position) return;
    path_.Add(*position);
    if (last_body_ && (*position - *last_body_).norm() < kBetweenBodies) return;
    last_body_ = position;
    bodies_.Add(BodyAt(*now_->problem, Eigen::Map<const Eigen::VectorXd>(message.state, message.num_states)));
  }

  void AddExecution(const execution_event_t& event) {
    if (event.kind == execution_event_t::STARTED || event.kind == execution_event_t::STEP_INSIDE ||
        event.kind == execution_event_t::STEP_CONSISTENT)
      if (const auto plan = executed_.find(event.plan_id); plan != executed_.end()) plan->second.insert(event.step);
    if (event.kind == execution_event_t::GOAL_REACHED) arrived_ = true;
    const bool stops = event.kind == execution_event_t::STANDING || event.kind == execution_event_t::STEP_OUTSIDE ||
                       event.kind == execution_event_t::OFF_SCHEDULE ||
                       event.kind == execution_event_t::EMERGENCY_STOP ||
                       (event.kind == execution_event_t::ERROR_STOP && event.plan_id >= 0);
    const auto position = PositionOf(event.state, event.num_states);
    if (stops && !arrived_ && position) stops_.Add(*position);
  }

  const Config* now_ = nullptr;  // the task in force
  const BusOptions channels_;
  std::vector<std::vector<std::vector<Picture::Polygon>>> outlines_;  // of each case
  // Of certified plans, by plan_id: the polygons of each step.
  std::map<std::int64_t, std::vector<std::vector<Picture::Polygon>>> tubes_;
  std::optional<Eigen::Vector2d> last_body_;        // where one was drawn
  std::map<std::int64_t, std::set<int>> executed_;  // of certified plans that may be drawn, by plan_id: the steps
  std::deque<RecordedCase> certified_, abstained_;  // that may be drawn
  KeptObstacles obstacles_;                         // of these
  Thinned<Eigen::Vector2d> path_, stops_;
  Thinned<std::vector<Picture::Polygon>> bodies_;
  bool arrived_ = false;
  LogPicture result_;
};

std::string TitleOf(const Config& config) {
  std::string name = config.problem->model->name();
  std::ranges::replace(name, '_', ' ');
  if (!name.empty()) name[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(name[0])));
  return fmt::format("{}: certified at {}, and the driven path", name,
                     config.problem->between ? "all times" : "the sample instants");
}

std::string DurationText(double microseconds) {
  return microseconds < 1000 ? fmt::format("{:.0f} \u00b5s", microseconds)
                             : fmt::format("{:.1f} ms", microseconds / 1000);
}

std::vector<std::string> KeyNumbers(const Summary& summary) {
  const auto abstained = [&summary](const char* cause) {
    const auto found = summary.abstained.find(cause);
    return found == summary.abstained.end() ? std::int64_t{0} : found->second;
  };
  std::vector<std::string> numbers{fmt::format("{} plans proposed", summary.proposed),
                                   fmt::format("{} certified under the declaration", summary.certified)};
  const auto add = [&numbers](std::int64_t count, const char* name) {
    if (count > 0) numbers.push_back(fmt::format("{} {}", count, name));
  };
  add(abstained("pairwise") + abstained("bound"), "abstained F");
  add(abstained("domain_exit") + abstained("no_finite_enclosure") + abstained("no_stop") + abstained("between"),
      "abstained D");
  add(abstained("obstacle") + abstained("limit"), "abstained S");
  add(abstained("no_obstacles"), "abstained without obstacles");
  if (summary.latency_us.WasMeasured())
    numbers.push_back(fmt::format("decided in {} (p50), {} (p99)", DurationText(summary.latency_us.p50),
                                  DurationText(summary.latency_us.p99)));
  numbers.push_back(fmt::format("{} of {} steps inside", summary.steps_inside,
                                summary.steps_inside + summary.steps_consistent + summary.steps_outside));
  add(summary.steps_consistent, "consistent (within the state error)");
  numbers.push_back(fmt::format("{} contacts", summary.contacts));
  if (summary.has_limits || summary.limits_exceeded > 0)
    numbers.push_back(fmt::format("{} times a limit exceeded", summary.limits_exceeded));
  return numbers;
}

const RunLogs& OnlyRun(const NamedRuns& named) {
  std::vector<const RunLogs*> runs;
  for (const RunLogs& run : named.runs)
    if (!run.logs.empty()) runs.push_back(&run);
  if (runs.empty()) throw LogError(fmt::format("{}: no log of a run is there", forereach::NameOf(named.runs.front())));
  if (runs.size() == 1) return *runs.front();
  throw LogError(
      fmt::format("{}: does not follow {}, and is of another run: name the files of one run, in the order of their "
                  "names; with --out "
                  "several runs are shown",
                  runs[1]->logs.front(), runs[0]->logs.back()));
}

}  // namespace

LogPicture PictureFromLogs(const std::vector<std::string>& logs, const Config& task) {
  PictureMaker maker(task.bus);
  Timeline timeline(task, {&maker});
  timeline.Read(logs, false);
  return maker.Finish(timeline, task);
}

bool Report(const ReportOptions& options, std::ostream& out) {
  const std::vector<std::string> files =
      options.picture.empty() ? std::vector<std::string>() : PictureFiles(options.picture);
  const RunTasks of_runs(options.config, options.key, false);
  const NamedRuns named = RunsNamedBy(options.logs, AllCores());
  const std::vector<std::string>& logs = OnlyRun(named).logs;
  LogTasks tasks = of_runs.Of(logs);
  tasks.RequirePlans();
  Summarizer summarizer(tasks.first());
  PictureMaker maker(tasks.first().bus);
  ShadowTally shadow_tally(AllCores());
  std::vector<TimelineUser*> users{&summarizer, &shadow_tally};
  if (!files.empty()) users.push_back(&maker);
  Timeline timeline(tasks, users);
  timeline.Read(logs, false);
  const Config& last = *tasks.found().back();
  const Summary summary = summarizer.Finish(timeline, last);
  const ShadowSummary shadow = shadow_tally.Finish();
  LogPicture drawn;
  if (!files.empty()) {
    drawn = maker.Finish(timeline, last);
    drawn.picture.title = TitleOf(last);
    drawn.picture.key_numbers = KeyNumbers(summary);
    if (shadow.any())
      drawn.picture.key_numbers.insert(drawn.picture.key_numbers.begin(), "SHADOW: nothing was certified");
  }
  for (const std::string& file : files) DrawPicture(drawn.picture, file);

  const bool is_whole = summary.damage.places == 0 && named.missing.empty();
  if (options.json) {
    nlohmann::json json = ToJson(summary);
    json["shadow"] = ToJson(shadow);
    json["logs"] = logs;
    json["pictures"] = files;
    json["tubes_left_out"] = drawn.disagreements;
    if (drawn.earlier > 0) json["earlier_tubes_left_out"] = drawn.earlier;
    if (named.is_many) json["missing"] = named.missing;
    out << JsonText(json, 2) << "\n";
    return is_whole;
  }
  out << ToText(shadow) << ToText(summary);
  for (const std::string& missing : named.missing) out << fmt::format("{:<26}{}\n", "not read", Printable(missing));
  for (const std::string& file : files) out << fmt::format("{:<26}{}\n", "picture", file);
  if (drawn.disagreements > 0)
    out << fmt::format("{:<26}{} (this task file decides them otherwise than the log)\n", "tubes left out",
                       drawn.disagreements);
  if (drawn.earlier > 0)
    out << fmt::format("{:<26}{} before the last ones of their kind\n", "tubes not drawn", drawn.earlier);
  return is_whole;
}

}  // namespace forereach
