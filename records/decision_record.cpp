#include "records/decision_record.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <iterator>
#include <set>
#include <sstream>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "forereach/certify/explain.h"
#include "forereach/decision_t.hpp"
#include "forereach/safety/placement.h"
#include "lcmtypes/names.h"
#include "records/decision_json.h"
#include "task/json_field.h"
#include "task/json_text.h"

namespace forereach {
namespace {

Eigen::MatrixXd Columns(const JsonField& field, int rows) {
  Eigen::MatrixXd matrix(rows, static_cast<Eigen::Index>(field.Count()));
  for (Eigen::Index j = 0; j < matrix.cols(); ++j)
    matrix.col(j) = field[static_cast<std::size_t>(j)].Numbers(static_cast<std::size_t>(rows));
  return matrix;
}

class Reading {
 public:
  Reading(const std::string& path, const JsonField& document, const Config& config)
      : document_(document), config_(config), record_{path, {}, {}, {}} {
    std::istringstream words(
        "outcome holds cause step coordinate exit first_observation second_observation obstacle part closest_step "
        "margin threshold message capped inputs tube digests elapsed_us");
    std::set<std::string> keys(std::istream_iterator<std::string>(words), {});
    if (config_.problem->declaration.IsDisturbed()) keys.insert("disturbance");
    document_.RequireFields(keys);
    if (!(document_["elapsed_us"].Number() >= 0)) document_["elapsed_us"].Fail("is negative");
    ReadInputs();
    ReadTube();
    CompareDigests();
    CompareWitness();
  }

  RecordedCertificate Take() { return std::move(record_); }

 private:
  void Compare(const JsonField& field, const nlohmann::json& expected) {
    if (field.json() == expected) return;
    record_.mismatches.push_back({kAltered + field.name(), JsonText(expected), JsonText(field.json())});
  }

  void ReadInputs() {
    const JsonField inputs = document_["inputs"];
    inputs.RequireFields({"config", "controls", "initial_set", "schedule"});
    inputs["config"].RequireFields({"given", "absolute"});
    inputs["initial_set"].RequireFields({"lower", "upper"});
    const NominalModel& model = *config_.problem->model;
    record_.certificate.controls = Columns(inputs["controls"], model.num_inputs());
    if (record_.certificate.controls.cols() == 0) inputs["controls"].Fail("is empty");
    verifier::InitialSet& set = record_.certificate.initial_set;
    const auto n = static_cast<std::size_t>(model.num_states());
    set.lower = inputs["initial_set"]["lower"].Numbers(n);
    set.upper = inputs["initial_set"]["upper"].Numbers(n);
    if (set.lower != config_.initial_set.lower() || set.upper != config_.initial_set.upper())
      record_.mismatches.push_back(
          {kOtherInput + std::string("inputs.initial_set"), fmt::format("that of {}", config_.path), "another"});
    record_.certificate.obstacles = config_.obstacles;
    record_.certificate.stay_in = StayInOf(config_);
    const Schedule& schedule = record_.certificate.schedule =
        ScheduleFromZero(config_, static_cast<int>(record_.certificate.controls.cols()));
    Compare(
        inputs["schedule"],
        {{"start_us", schedule.start_us}, {"step_us", schedule.step_us}, {"clock_error_us", schedule.clock_error_us}});
  }

  void ReadTube() {
    const JsonField tube = document_["tube"];
    const Eigen::Index steps = record_.certificate.controls.cols();
    tube.RequireCount(static_cast<std::size_t>(steps + 1));
    for (Eigen::Index t = 0; t <= steps; ++t)
      record_.certificate.slices.push_back(SliceOf(tube[static_cast<std::size_t>(t)], t < steps));
  }

  verifier::RecordedSlice SliceOf(const JsonField& slice, bool completed) const {
    std::set<std::string> keys{"center", "half_width", "generators", "clearance", "radius"};
    if (completed) keys.insert({"envelope", "remainder"});
    slice.RequireFields(keys);
    const auto n = static_cast<std::size_t>(config_.problem->model->num_states());
    verifier::RecordedSlice recorded;
    recorded.center = slice["center"].Numbers(n);
    recorded.half_width = slice["half_width"].Numbers(n);
    recorded.generators = Columns(slice["generators"], config_.problem->model->num_states());
    recorded.has_generators = true;
    // From this sample to the next there is nothing after the last. Null: the obstacle is nowhere at that time.
    const JsonField clearance = slice["clearance"];
    clearance.RequireCount(completed || !config_.problem->between ? config_.obstacles.size() : 0);
    for (std::size_t o = 0; o < clearance.Count(); ++o)
      recorded.clearance.push_back(clearance[o].json().is_null() ? kInfinity : clearance[o].Number());
    // The radius is the root of a sum of squares. Where these overflow, from 1e154 on, it is recorded as null.
    const bool is_huge = std::ranges::any_of(recorded.half_width, [](double r) { return r > 1e150; });
    if (!is_huge || !slice["radius"].json().is_null()) recorded.radius = slice["radius"].Number();
    if (!completed) return recorded;
    const JsonField envelope = slice["envelope"];
    envelope.RequireFields({"lower", "upper"});
    recorded.envelope_lower = envelope["lower"].Numbers(n);
    recorded.envelope_upper = envelope["upper"].Numbers(n);
    recorded.remainder = slice["remainder"].Numbers(n);
    return recorded;
  }

  void CompareDigests() {
    const JsonField digests = document_["digests"];
    const verifier::InitialSet& set = record_.certificate.initial_set;
    // Bounds that are no box have no digest; the verifier refutes them.
    const bool is_box = (set.lower.array() <= set.upper.array()).all();
    const std::string plan =
        is_box ? ToHex(PlanDigest(record_.certificate.controls, Box(set.lower, set.upper))) : "one of a box";
    std::vector<std::array<std::string, 3>> expected{{kAltered, "tube", ToHex(TubeDigest(document_["tube"].json()))},
                                                     {kAltered, "plan", plan}};
    const Grounds grounds = config_.grounds;
    for (const auto& [name, digest] : kGrounds) expected.push_back({kOtherInput, name, ToHex(grounds.*digest)});
    std::set<std::string> keys;
    for (const auto& [what, name, digest] : expected) {
      keys.insert(name);
      record_.Compare(fmt::format("{}digest of {}{}", what, what == kOtherInput ? "the " : "", name), digest,
                      digests[name].Text());
    }
    digests.RequireFields(keys);
  }

  // What follows from the clearances, which the verifier derives: the closest slice, and the sentence about it.
  void CompareWitness() {
    Compare(document_["holds"], HoldsName(*config_.problem));
    if (const Declaration& declaration = config_.problem->declaration; declaration.IsDisturbed())
      Compare(document_["disturbance"], DisturbanceJson(declaration));
    for (const char* of_abstentions :
         {"cause", "step", "coordinate", "exit", "first_observation", "second_observation"})
      Compare(document_[of_abstentions], nullptr);
    const auto& slices = record_.certificate.slices;
    double clearance = kInfinity;
    int step = -1, obstacle = -1;
    const auto consider = [&](std::size_t t, std::size_t o) {
      if (!(slices[t].clearance[o] < clearance)) return;
      clearance = slices[t].clearance[o];
      step = static_cast<int>(t), obstacle = static_cast<int>(o);
    };
    // Of several that are equally close the record may name any.
    const nlohmann::json &named_step = document_["closest_step"].json(), &named_obstacle = document_["obstacle"].json();
    if (named_step.is_number_unsigned() && named_obstacle.is_number_unsigned() && named_step < slices.size() &&
        named_obstacle < slices[named_step.get<std::size_t>()].clearance.size())
      consider(named_step.get<std::size_t>(), named_obstacle.get<std::size_t>());
    for (std::size_t t = 0; t < slices.size(); ++t)
      for (std::size_t o = 0; o < slices[t].clearance.size(); ++o) consider(t, o);

    const JsonField margin = document_["margin"], threshold = document_["threshold"];
    int part = -1;
    if (obstacle < 0) {
      for (const char* key : {"obstacle", "part", "closest_step", "margin", "threshold"})
        Compare(document_[key], nullptr);
    } else {
      // Which of several parts is the closest is not derived. Null: the bound is that of the whole body.
      const int parts = static_cast<int>(config_.problem->body.parts.size());
      if (parts == 1)
        Compare(document_["part"], 0);
      else if (!document_["part"].json().is_null())
        part = document_["part"].Integer(0, parts - 1);
      Compare(document_["obstacle"], obstacle);
      Compare(document_["closest_step"], step);
      const std::vector<double> thresholds = ThresholdsOf(
          *config_.problem, config_.obstacles[static_cast<std::size_t>(obstacle)], record_.certificate.schedule, step);
      const double by_body = thresholds.back(),
                   by_part = part < 0 ? by_body : thresholds[static_cast<std::size_t>(part)];
      const bool is_kept_by_one = parts == 1 && threshold.json() == thresholds.front();
      if (!is_kept_by_one) Compare(threshold, by_part);
      const double claimed = SubDown(margin.Number(), threshold.Number());
      if (claimed != clearance)
        record_.Compare(fmt::format("{}{} less the distance to be kept", kAltered, margin.name()),
                        JsonText(nlohmann::json(clearance)), JsonText(nlohmann::json(claimed)));
    }
    const std::string sentence =
        ExplainCertificate(*config_.problem, {step, obstacle, part, clearance}, config_.obstacles);
    Compare(document_["message"], sentence + (document_["capped"].Bool() ? kCapped : ""));
  }

  const JsonField& document_;
  const Config& config_;
  RecordedCertificate record_;
};

}  // namespace

std::vector<verifier::StayIn> StayInOf(const Config& config) {
  std::vector<verifier::StayIn> areas;
  for (const auto& [name, area] : config.keep_in) {
    verifier::StayIn& stay_in = areas.emplace_back(verifier::StayIn{name, {}});
    std::vector<Ring> rings{area.outer};
    rings.insert(rings.end(), area.holes.begin(), area.holes.end());
    for (const Ring& ring : rings)
      for (auto& corners = stay_in.rings.emplace_back(); const auto& [x, y] : ring) corners.emplace_back(x, y);
  }
  return areas;
}

std::vector<double> ThresholdsOf(const Problem& problem, const Obstacle& obstacle, const Schedule& schedule, int t) {
  const Placement placement = PlacementOf(problem);
  const double growth =
      obstacle.motion() ? Meet(*obstacle.motion(), schedule, t, t + (placement.sweeps() ? 1 : 0)).growth : 0;
  std::vector<double> thresholds;
  for (const Placement::Part& part : placement.parts())
    thresholds.push_back(AddUp(obstacle.radius(), AddUp(part.radius, growth)));
  thresholds.push_back(AddUp(obstacle.radius(), AddUp(growth, placement.reach())));
  return thresholds;
}

std::string TaskOf(const std::string& path, const nlohmann::json& document) {
  const JsonField config = JsonField(path, document)["inputs"]["config"];
  const std::string absolute = config["absolute"].Text(), given = config["given"].Text();
  std::error_code no_path;
  return std::filesystem::exists(absolute, no_path) ? absolute : given;
}

bool IsCertificate(const std::string& path, const nlohmann::json& document) {
  const JsonField outcome = JsonField(path, document)["outcome"];
  const std::string name = outcome.Text();
  for (const std::int16_t abstention :
       {decision_t::ABSTAIN_FALSIFIED, decision_t::ABSTAIN_DOMAIN, decision_t::ABSTAIN_SAFETY})
    if (name == OutcomeName(abstention)) return false;
  if (name != OutcomeName(decision_t::CERTIFIED)) outcome.Fail(fmt::format("'{}' is no outcome", name.substr(0, 40)));
  return true;
}

RecordedCertificate ReadCertificate(const std::string& path, const nlohmann::json& document, const Config& config) {
  return Reading(path, JsonField(path, document), config).Take();
}

}  // namespace forereach
