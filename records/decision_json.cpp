#include "records/decision_json.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <nlohmann/json.hpp>

#include "forereach/certify/explain.h"
#include "forereach/certify/tube.h"
#include "forereach/safety/separation.h"
#include "forereach/sets/zonogon.h"
#include "lcmtypes/names.h"
#include "task/step_time.h"

namespace forereach {

nlohmann::json DisturbanceJson(const Declaration& declaration) {
  nlohmann::json bounds = nlohmann::json::array();
  for (Eigen::Index k = 0; k < declaration.noise_bound.size(); ++k)
    bounds.push_back(declaration.Grows(k) ? nlohmann::json(declaration.DisturbanceText(k))
                                          : nlohmann::json(declaration.DisturbanceBound(k)));
  return bounds;
}

namespace {

using Json = nlohmann::json;

Json IndexJson(int index) { return index < 0 ? Json(nullptr) : Json(index); }
Json NumberJson(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json SliceJson(const Tube& tube, int t, const Certifier& certifier, std::span<const Obstacle> obstacles,
               const Schedule& schedule) {
  const Zonotope& slice = tube.slice(t);
  Json half_width = Json::array(), generators = Json::array(), clearance = Json::array();
  for (int k = 0; k < slice.dim(); ++k) half_width.push_back(slice.HalfWidthUpper(k));
  const Eigen::MatrixXd matrix = slice.GeneratorMatrix();
  for (const auto column : matrix.colwise()) generators.push_back(std::vector(column.begin(), column.end()));
  Zonotope projected;
  certifier.projection().Enclose(slice, tube.half_width(t), projected);
  for (const Obstacle& obstacle : obstacles)
    if (t < certifier.safety().NumUnits(tube))
      clearance.push_back(
          NumberJson(std::max(certifier.SeparateSlice(tube, t, obstacle, schedule).clearance(), -kMaxDouble)));
  return {{"center", slice.center()},
          {"half_width", half_width},
          {"generators", generators},
          {"clearance", clearance},
          {"radius", RadiusUpper(projected)}};
}

Json TubeJson(const Tube& tube, const Certifier& certifier, std::span<const Obstacle> obstacles,
              const Schedule& schedule) {
  Json slices = Json::array();
  const auto n = static_cast<std::size_t>(certifier.problem().model->num_states());
  for (int t = 0; t <= tube.length(); ++t) {
    Json slice = SliceJson(tube, t, certifier, obstacles, schedule);
    if (t < tube.length()) {
      const StepRecord& step = tube.step(t);
      slice["envelope"] = {{"lower", std::span(step.envelope.lower.data(), n)},
                           {"upper", std::span(step.envelope.upper.data(), n)}};
      slice["remainder"] = std::span(step.remainder.half_width.data(), n);
    }
    slices.push_back(std::move(slice));
  }
  return slices;
}

const char* KindName(DomainExit::Kind kind) {
  switch (kind) {
    case DomainExit::Kind::kLower: return "lower";
    case DomainExit::Kind::kUpper: return "upper";
    case DomainExit::Kind::kInequality: return "inequality";
    case DomainExit::Kind::kBall: return "ball";
    case DomainExit::Kind::kNone: break;
  }
  return nullptr;
}

// Adds what the outcome rests on.
void AddWitness(const Decision& decision, Json& document) {
  const char* const exit = KindName(decision.exit.kind);
  document["step"] = IndexJson(decision.step);
  document["coordinate"] = IndexJson(decision.coordinate);
  document["exit"] = exit ? Json(exit) : Json(nullptr);
  document["first_observation"] = IndexJson(decision.first_observation);
  document["second_observation"] = IndexJson(decision.second_observation);
  document["obstacle"] = IndexJson(decision.obstacle);
  document["part"] = IndexJson(decision.part);
  document["closest_step"] = IndexJson(decision.closest_step);
  document["margin"] = NumberJson(decision.margin);
  const bool without_obstacles = decision.outcome == Outcome::kCertified && decision.obstacle < 0;
  document["threshold"] = without_obstacles ? Json(nullptr) : NumberJson(decision.threshold);
}

Json InputsJson(const CertifyResult& result, const Config& config) {
  Json steps = Json::array();
  for (const auto column : result.controls.colwise()) steps.push_back(std::vector(column.begin(), column.end()));
  const Box& set = config.initial_set;
  return {{"config",
           {{"given", config.path}, {"absolute", std::filesystem::absolute(config.path).lexically_normal().string()}}},
          {"controls", steps},
          {"schedule",
           {{"start_us", result.schedule.start_us},
            {"step_us", result.schedule.step_us},
            {"clock_error_us", result.schedule.clock_error_us}}},
          {"initial_set",
           {{"lower", std::vector(set.lower().begin(), set.lower().end())},
            {"upper", std::vector(set.upper().begin(), set.upper().end())}}}};
}

void Append(CanonicalBytes& bytes, const Json& value) {
  if (value.is_object()) {
    bytes.Text("object");
    bytes.Count(static_cast<std::int64_t>(value.size()));
    for (const auto& [key, entry] : value.items()) {  // sorted by key
      bytes.Text(key);
      Append(bytes, entry);
    }
  } else if (value.is_array()) {
    bytes.Text("array");
    bytes.Count(static_cast<std::int64_t>(value.size()));
    for (const Json& entry : value) Append(bytes, entry);
  } else if (value.is_number() && std::isfinite(value.get<double>())) {
    bytes.Text("number");
    bytes.Number(value.get<double>());
  } else {
    bytes.Text(value.is_string() ? value.get<std::string>() : "null");
  }
}

}  // namespace

Schedule ScheduleFromZero(const Config& config, int steps) {
  const double step_us = config.period * 1e6;
  const auto whole = std::max(std::int64_t{1}, static_cast<std::int64_t>(std::llround(step_us)));
  const double off = AddUp(std::abs(static_cast<double>(whole) - MulUp(config.period, 1e6)),
                           std::abs(MulUp(config.period, 1e6) - MulDown(config.period, 1e6)));
  const double error = AddUp(MulUp(off, steps), static_cast<double>(ScheduleErrorUs(config.gate)));
  return {0, whole, static_cast<std::int64_t>(std::ceil(error))};
}

Digest PlanDigest(const Eigen::MatrixXd& controls, const Box& initial_set) {
  CanonicalBytes bytes("plan");
  bytes.Numbers(controls);
  bytes.Numbers(initial_set.lower());
  bytes.Numbers(initial_set.upper());
  return bytes.digest();
}

Digest TubeDigest(const nlohmann::json& tube) {
  CanonicalBytes bytes("forereach tube");
  Append(bytes, tube);
  return bytes.digest();
}

nlohmann::json ToJson(const CertifyResult& result, const Tube& tube, const Certifier& certifier, const Config& config) {
  const Decision& decision = result.decision;
  const bool before_any_step = decision.outcome == Outcome::kFalsified && decision.step < 0;
  Json document;
  document["outcome"] = OutcomeName(static_cast<std::int16_t>(decision.outcome));
  document["holds"] = HoldsName(certifier.problem());
  if (const Declaration& declaration = certifier.problem().declaration; declaration.IsDisturbed())
    document["disturbance"] = DisturbanceJson(declaration);
  AddWitness(decision, document);
  document["cause"] =
      decision.cause == Cause::kNone ? Json(nullptr) : Json(CauseName(static_cast<std::int16_t>(decision.cause)));
  document["capped"] = decision.capped;
  const auto inputs = static_cast<int>(result.controls.rows());
  const Plan plan{result.controls.data(), inputs, static_cast<int>(result.controls.cols()), inputs, result.schedule};
  document["message"] = Explain(decision, certifier, config.obstacles, plan, tube);
  document["inputs"] = InputsJson(result, config);
  document["tube"] = before_any_step ? Json::array() : TubeJson(tube, certifier, config.obstacles, result.schedule);
  document["digests"] = {{"plan", ToHex(PlanDigest(result.controls, config.initial_set))},
                         {"tube", ToHex(TubeDigest(document["tube"]))}};
  const Grounds grounds = config.grounds;
  for (const auto& [name, digest] : kGrounds) document["digests"][name] = ToHex(grounds.*digest);
  document["elapsed_us"] = result.elapsed_us;
  return document;
}

}  // namespace forereach
