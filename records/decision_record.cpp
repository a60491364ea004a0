#include "records/decision_record.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include "certifier/certify/explain.h"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "records/decision_json.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

// A value of the document with its name in it.
class Field {
 public:
  Field(const std::string& path, std::string name, const Json& value)
      : path_(path), name_(std::move(name)), value_(value) {}

  [[noreturn]] void Fail(const std::string& what) const { throw ConfigError(path_ + ": " + name_ + ": " + what); }

  [[nodiscard]] Field operator[](const std::string& key) const {
    Require(value_.is_object(), "an object");
    const std::string name = name_.empty() ? key : name_ + "." + key;
    const auto found = value_.find(key);
    if (found == value_.end()) throw ConfigError(path_ + ": " + name + ": missing");
    return {path_, name, *found};
  }
  [[nodiscard]] Field operator[](std::size_t i) const {
    return {path_, name_ + "[" + std::to_string(i) + "]", value_.at(i)};
  }

  // An object with these keys and no other.
  void RequireKeys(const std::set<std::string>& keys) const {
    for (const std::string& key : keys) (void)(*this)[key];
    for (const auto& [key, value] : value_.items())
      if (!keys.contains(key))
        throw ConfigError(path_ + ": " + (name_.empty() ? "" : name_ + ".") + key + ": unknown; nothing checks it");
  }
  [[nodiscard]] std::size_t List() const {
    Require(value_.is_array(), "a list");
    return value_.size();
  }
  void RequireSize(Eigen::Index size) const {
    if (static_cast<Eigen::Index>(List()) != size)
      Fail("has " + std::to_string(value_.size()) + " entries, must have " + std::to_string(size));
  }

  [[nodiscard]] double Number() const {
    Require(value_.is_number() && std::isfinite(value_.get<double>()), "a number");
    return value_.get<double>();
  }
  [[nodiscard]] bool Bool() const {
    Require(value_.is_boolean(), "true or false");
    return value_.get<bool>();
  }
  [[nodiscard]] std::string Text() const {
    Require(value_.is_string(), "text");
    return value_.get<std::string>();
  }
  [[nodiscard]] Eigen::VectorXd Vector(Eigen::Index size) const {
    RequireSize(size);
    Eigen::VectorXd vector(size);
    for (Eigen::Index i = 0; i < size; ++i) vector[i] = (*this)[static_cast<std::size_t>(i)].Number();
    return vector;
  }
  [[nodiscard]] Eigen::MatrixXd Columns(Eigen::Index rows) const {
    Eigen::MatrixXd matrix(rows, static_cast<Eigen::Index>(List()));
    for (Eigen::Index j = 0; j < matrix.cols(); ++j) matrix.col(j) = (*this)[static_cast<std::size_t>(j)].Vector(rows);
    return matrix;
  }
  [[nodiscard]] const Json& json() const { return value_; }
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  void Require(bool good, const char* type) const {
    if (!good) Fail("is not " + std::string(type));
  }

  const std::string& path_;
  const std::string name_;
  const Json& value_;
};

class Reading {
 public:
  Reading(const std::string& path, const Field& document, const Config& config)
      : document_(document), config_(config), record_{path, {}, {}, {}} {
    document_.RequireKeys({"outcome", "cause", "step", "coordinate", "exit", "first_observation", "second_observation",
                           "obstacle", "closest_step", "margin", "threshold", "message", "capped", "inputs", "tube",
                           "digests", "elapsed_us"});
    if (!(document_["elapsed_us"].Number() >= 0)) document_["elapsed_us"].Fail("is negative");
    ReadInputs();
    ReadTube();
    CompareDigests();
    CompareWitness();
  }

  RecordedCertificate Take() { return std::move(record_); }

 private:
  void Compare(const Field& field, const Json& expected) {
    if (field.json() == expected) return;
    record_.mismatches.push_back(
        {kAltered + field.name(), expected.dump(), field.json().dump(-1, ' ', false, Json::error_handler_t::replace)});
  }

  void ReadInputs() {
    const Field inputs = document_["inputs"];
    inputs.RequireKeys({"config", "controls", "initial_set"});
    inputs["config"].RequireKeys({"given", "absolute"});
    inputs["initial_set"].RequireKeys({"lower", "upper"});
    const NominalModel& model = *config_.problem->model;
    record_.certificate.controls = inputs["controls"].Columns(model.num_inputs());
    if (record_.certificate.controls.cols() == 0) inputs["controls"].Fail("is empty");
    verifier::InitialSet& set = record_.certificate.initial_set;
    set.lower = inputs["initial_set"]["lower"].Vector(model.num_states());
    set.upper = inputs["initial_set"]["upper"].Vector(model.num_states());
    if (set.lower != config_.initial_set.lower() || set.upper != config_.initial_set.upper())
      record_.mismatches.push_back(
          {kOtherInput + std::string("inputs.initial_set"), "that of " + config_.path, "another"});
    record_.certificate.obstacles = config_.obstacles;
  }

  void ReadTube() {
    const Field tube = document_["tube"];
    const Eigen::Index steps = record_.certificate.controls.cols();
    tube.RequireSize(steps + 1);
    for (Eigen::Index t = 0; t <= steps; ++t)
      record_.certificate.slices.push_back(SliceOf(tube[static_cast<std::size_t>(t)], t < steps));
  }

  verifier::RecordedSlice SliceOf(const Field& slice, bool completed) const {
    std::set<std::string> keys{"center", "half_width", "generators", "clearance", "radius"};
    if (completed) keys.insert({"envelope", "remainder"});
    slice.RequireKeys(keys);
    const int n = config_.problem->model->num_states();
    verifier::RecordedSlice recorded;
    recorded.center = slice["center"].Vector(n);
    recorded.half_width = slice["half_width"].Vector(n);
    recorded.generators = slice["generators"].Columns(n);
    recorded.has_generators = true;
    const Eigen::VectorXd clearance = slice["clearance"].Vector(std::ssize(config_.obstacles));
    recorded.clearance.assign(clearance.begin(), clearance.end());
    recorded.radius = slice["radius"].Number();
    if (!completed) return recorded;
    const Field envelope = slice["envelope"];
    envelope.RequireKeys({"lower", "upper"});
    recorded.envelope_lower = envelope["lower"].Vector(n);
    recorded.envelope_upper = envelope["upper"].Vector(n);
    recorded.remainder = slice["remainder"].Vector(n);
    return recorded;
  }

  void CompareDigests() {
    const Field digests = document_["digests"];
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
      record_.Compare(what + "digest of " + (what == kOtherInput ? "the " : "") + name, digest, digests[name].Text());
    }
    digests.RequireKeys(keys);
  }

  // What follows from the clearances, which the verifier derives: the closest slice, and the sentence about it.
  void CompareWitness() {
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
    const Json &named_step = document_["closest_step"].json(), &named_obstacle = document_["obstacle"].json();
    if (named_step.is_number_unsigned() && named_obstacle.is_number_unsigned() && named_step < slices.size() &&
        named_obstacle < config_.obstacles.size())
      consider(named_step.get<std::size_t>(), named_obstacle.get<std::size_t>());
    for (std::size_t t = 0; t < slices.size(); ++t)
      for (std::size_t o = 0; o < config_.obstacles.size(); ++o) consider(t, o);

    const Field margin = document_["margin"], threshold = document_["threshold"];
    if (obstacle < 0) {
      for (const char* key : {"obstacle", "closest_step", "margin", "threshold"}) Compare(document_[key], nullptr);
    } else {
      const double radius = config_.obstacles[static_cast<std::size_t>(obstacle)].radius();
      Compare(document_["obstacle"], obstacle);
      Compare(document_["closest_step"], step);
      Compare(threshold, Json(radius));
      const double claimed = SubDown(margin.Number(), radius);
      if (claimed != clearance)
        record_.Compare(kAltered + margin.name() + " less the radius", Json(clearance).dump(), Json(claimed).dump());
    }
    const std::string sentence = ExplainCertificate(step, obstacle, clearance);
    Compare(document_["message"], sentence + (document_["capped"].Bool() ? kCapped : ""));
  }

  const Field& document_;
  const Config& config_;
  RecordedCertificate record_;
};

}  // namespace

std::string TaskOf(const std::string& path, const Json& document) {
  const Field config = Field(path, "", document)["inputs"]["config"];
  const std::string absolute = config["absolute"].Text(), given = config["given"].Text();
  std::error_code no_path;
  return std::filesystem::exists(absolute, no_path) ? absolute : given;
}

bool IsCertificate(const std::string& path, const Json& document) {
  const Field outcome = Field(path, "", document)["outcome"];
  const std::string name = outcome.Text();
  for (const std::int16_t abstention :
       {decision_t::ABSTAIN_FALSIFIED, decision_t::ABSTAIN_DOMAIN, decision_t::ABSTAIN_SAFETY})
    if (name == OutcomeName(abstention)) return false;
  if (name != OutcomeName(decision_t::CERTIFIED)) outcome.Fail("'" + name.substr(0, 40) + "' is no outcome");
  return true;
}

RecordedCertificate ReadCertificate(const std::string& path, const Json& document, const Config& config) {
  return Reading(path, Field(path, "", document), config).Take();
}

}  // namespace forereach
