#include "certifier/gate/gate.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "certifier/certify/explain.h"
#include "certifier/gate/candidate_message.h"
#include "certifier/gate/obstacle_message.h"
#include "certifier/numerics/text.h"
#include "lcmtypes/seal.h"

namespace forereach {
namespace {

// The bus contract fixes the numbers, so they are the same on both sides.
static_assert(static_cast<int>(Outcome::kCertified) == 1 && static_cast<int>(Outcome::kSafety) == 4);
static_assert(static_cast<int>(Cause::kPairwise) == 1 && static_cast<int>(Cause::kObstacle) == 4);

std::int64_t Microseconds(double milliseconds) { return std::llround(milliseconds * 1e3); }

std::string Milliseconds(std::int64_t later, std::int64_t earlier) {
  return ToText(std::round((static_cast<double>(later) - static_cast<double>(earlier)) / 1e3)) + " ms";
}

template <class Range>
bool AllFinite(const Range& values) {
  return std::ranges::all_of(values, [](double value) { return std::isfinite(value); });
}

}  // namespace

Gate::Gate(const Config& config)
    : certifier_(config.problem),
      options_(config.gate),
      config_digest_(config.digest),
      model_digest_(config.model_digest),
      declaration_digest_(config.declaration_digest),
      observations_digest_(config.observations_digest),
      obstacles_digest_(config.obstacles_digest),
      obstacles_(config.obstacles) {}

GateAnswer Gate::Decide(Bytes candidate, std::int64_t now_us) noexcept { return Answer(candidate, now_us, false); }

GateAnswer Gate::Displace(Bytes candidate, std::int64_t now_us) noexcept { return Answer(candidate, now_us, true); }

GateAnswer Gate::Answer(Bytes bytes, std::int64_t now_us, bool displaced) {
  GateAnswer answer;
  decision_t& decision = answer.decision;
  decision.utime = now_us;
  decision.sequence = decisions_++;
  decision.outcome = decision_t::REJECTED;
  decision.cause = decision_t::CAUSE_INTERNAL_ERROR;
  decision.step = decision.coordinate = decision.obstacle = -1;
  decision.first_observation = decision.second_observation = -1;
  SetDigests(decision);
  SetDigest(decision.plan_digest, DigestOf(bytes));
  try {
    candidate_plan_t candidate{};
    std::optional<Rejection> rejection = Admit(bytes, candidate, now_us);
    if (displaced) rejection = {decision_t::CAUSE_QUEUE_FULL, "newer candidates displaced it from the queue"};
    decision.candidate_utime = candidate.utime;
    decision.plan_id = candidate.plan_id;
    std::ranges::copy(candidate.source, decision.source);
    if (rejection) {
      decision.cause = rejection->cause;
      SetText(decision.message, "rejected: " + rejection->why);
    } else {
      Certify(candidate, answer);
    }
  } catch (const std::exception& error) {
    decision.outcome = decision_t::REJECTED;
    decision.cause = decision_t::CAUSE_INTERNAL_ERROR;
    SetText(decision.message, std::string("rejected: internal error: ") + error.what());
    answer.certified.reset();
  }
  Count(decision.outcome);
  return answer;
}

std::optional<Gate::Rejection> Gate::Admit(Bytes bytes, candidate_plan_t& candidate, std::int64_t now_us) {
  const std::string size = std::to_string(bytes.size()) + " bytes";
  switch (Decode(bytes, candidate)) {
    case DecodeStatus::kUnknownFingerprint:
      return Rejection{decision_t::CAUSE_UNKNOWN_FINGERPRINT, "not a candidate_plan_t"};
    case DecodeStatus::kWrongLength:
      return Rejection{decision_t::CAUSE_WRONG_LENGTH,
                       size + ", must be " + std::to_string(EncodedSize<candidate_plan_t>())};
    case DecodeStatus::kTrailingBytes:
      return Rejection{decision_t::CAUSE_TRAILING_BYTES,
                       size + ", must be " + std::to_string(EncodedSize<candidate_plan_t>())};
    case DecodeStatus::kOk:
      break;
  }
  if (auto rejection = CheckContent(candidate)) return rejection;
  if (auto rejection = CheckTimes(candidate, now_us)) return rejection;
  return CheckSource(candidate);
}

std::optional<Gate::Rejection> Gate::CheckContent(const candidate_plan_t& candidate) const {
  const NominalModel& model = *certifier_.problem().model;
  const int states = candidate.num_states, inputs = candidate.num_inputs, steps = candidate.num_steps;
  if (states != model.num_states() || inputs != model.num_inputs() || steps < 1 || steps > kMaxSteps ||
      candidate.progress_steps < 0 || candidate.progress_steps > steps)
    return Rejection{decision_t::CAUSE_WRONG_DIMENSION,
                     std::to_string(states) + " states, " + std::to_string(inputs) + " inputs, " +
                         std::to_string(candidate.progress_steps) + " of " + std::to_string(steps) +
                         " steps; the task has " + std::to_string(model.num_states()) + " and " +
                         std::to_string(model.num_inputs()) + ", at most " + std::to_string(kMaxSteps) + " steps"};
  const auto first = [](const auto& field, int count) { return std::span(field, static_cast<std::size_t>(count)); };
  bool finite = AllFinite(first(candidate.initial_center, states)) && AllFinite(first(candidate.initial_half_width, states));
  for (int t = 0; t < steps; ++t) finite &= AllFinite(first(candidate.control[t], inputs));
  if (!finite) return Rejection{decision_t::CAUSE_NON_FINITE, "NaN or infinity in its initial set or controls"};
  for (const double half_width : first(candidate.initial_half_width, states))
    if (half_width < 0) return Rejection{decision_t::CAUSE_NON_FINITE, "negative half-width " + ToText(half_width)};
  return std::nullopt;
}

std::optional<Gate::Rejection> Gate::CheckTimes(const candidate_plan_t& candidate, std::int64_t now_us) const {
  const std::int64_t lifetime = Microseconds(options_.certificate_lifetime_ms);
  switch (FreshnessOf(candidate.utime, now_us, Microseconds(options_.max_age_ms), Microseconds(options_.max_ahead_ms))) {
    case Freshness::kStale:
      return Rejection{decision_t::CAUSE_STALE, "stamped " + Milliseconds(now_us, candidate.utime) + " ago, at most " +
                                                    ToText(options_.max_age_ms) + " ms allowed"};
    case Freshness::kFuture:
      return Rejection{decision_t::CAUSE_FUTURE, "stamped " + Milliseconds(candidate.utime, now_us) + " ahead, at most " +
                                                     ToText(options_.max_ahead_ms) + " ms allowed"};
    case Freshness::kFresh:
      break;
  }
  switch (FreshnessOf(candidate.start_utime, now_us, 0, lifetime)) {
    case Freshness::kStale:
      return Rejection{decision_t::CAUSE_TOO_LATE, "its start was " + Milliseconds(now_us, candidate.start_utime) + " ago"};
    case Freshness::kFuture:
      return Rejection{decision_t::CAUSE_FUTURE, "starts in " + Milliseconds(candidate.start_utime, now_us) +
                                                     ", a certificate lives " +
                                                     ToText(options_.certificate_lifetime_ms) + " ms"};
    case Freshness::kFresh:
      return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Gate::Rejection> Gate::CheckSource(const candidate_plan_t& candidate) {
  const std::string source(reinterpret_cast<const char*>(candidate.source), sizeof candidate.source);
  const auto known = last_plan_id_.find(source);
  if (known == last_plan_id_.end()) {
    if (last_plan_id_.size() >= kMaxSources)
      return Rejection{decision_t::CAUSE_TOO_MANY_SOURCES,
                       "more than " + std::to_string(kMaxSources) + " sources have sent candidates"};
    last_plan_id_.emplace(source, candidate.plan_id);
    return std::nullopt;
  }
  if (candidate.plan_id <= known->second)
    return Rejection{decision_t::CAUSE_DUPLICATE, "plan_id " + std::to_string(candidate.plan_id) +
                                                      " does not exceed this source's last, " +
                                                      std::to_string(known->second)};
  known->second = candidate.plan_id;
  return std::nullopt;
}

void Gate::Certify(const candidate_plan_t& candidate, GateAnswer& answer) {
  const Zonotope initial_set = InitialSetOf(candidate);
  const Plan plan = PlanOf(candidate);
  certifier_.Require(plan, initial_set, obstacles_);
  const Decision verdict = certifier_.Certify(plan, initial_set, obstacles_, tube_);

  decision_t& decision = answer.decision;
  decision.outcome = static_cast<std::int16_t>(verdict.outcome);
  decision.cause = static_cast<std::int16_t>(verdict.cause);
  decision.step = static_cast<std::int16_t>(verdict.step);
  decision.coordinate = static_cast<std::int16_t>(verdict.coordinate);
  decision.obstacle = static_cast<std::int16_t>(verdict.obstacle);
  decision.first_observation = verdict.first_observation;
  decision.second_observation = verdict.second_observation;
  decision.margin = verdict.margin;
  decision.threshold = verdict.threshold;
  SetText(decision.message, Explain(verdict, certifier_.problem()));
  if (verdict.outcome == Outcome::kCertified) Attest(candidate, decision, answer.certified.emplace());
}

void Gate::Attest(const candidate_plan_t& candidate, const decision_t& decision, certified_plan_t& certified) {
  certified.utime = decision.utime;
  certified.sequence = certificates_++;
  certified.expires_utime = decision.utime + Microseconds(options_.certificate_lifetime_ms);
  certified.plan = candidate;
  for (int t = 0; t <= candidate.num_steps; ++t) {
    for (int k = 0; k < candidate.num_states; ++k) {
      const Interval hull = tube_.hull(t, k);
      certified.slice_lower[t][k] = hull.lower;
      certified.slice_upper[t][k] = hull.upper;
    }
  }
  std::ranges::copy(decision.plan_digest, certified.plan_digest);
  SetDigests(certified);
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
}

std::string Gate::UpdateObstacles(Bytes bytes, std::int64_t now_us) {
  const auto message = Decoded<obstacles_t>(bytes);
  if (!message) return "not an obstacles_t of " + std::to_string(EncodedSize<obstacles_t>()) + " bytes";
  if (FreshnessOf(message->utime, now_us, Microseconds(options_.max_age_ms), Microseconds(options_.max_ahead_ms)) !=
      Freshness::kFresh)
    return "stamped " + Milliseconds(now_us, message->utime) + " ago";
  if (message->sequence <= last_obstacles_sequence_)
    return "sequence " + std::to_string(message->sequence) + " does not exceed the last, " +
           std::to_string(last_obstacles_sequence_);
  try {
    std::vector<Obstacle> obstacles = FromMessage(*message, certifier_.projection().dim());
    obstacles_digest_ = ObstaclesDigest(obstacles);
    obstacles_ = std::move(obstacles);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  last_obstacles_sequence_ = message->sequence;
  return {};
}

certifier_status_t Gate::Status(std::int64_t now_us) const {
  certifier_status_t status = counts_;
  status.utime = now_us;
  SetDigests(status);
  return status;
}

void Gate::Count(std::int16_t outcome) {
  ++counts_.candidates;
  switch (outcome) {
    case decision_t::CERTIFIED: ++counts_.certified; return;
    case decision_t::ABSTAIN_FALSIFIED: ++counts_.abstained_falsified; return;
    case decision_t::ABSTAIN_DOMAIN: ++counts_.abstained_domain; return;
    case decision_t::ABSTAIN_SAFETY: ++counts_.abstained_safety; return;
    default: ++counts_.rejected;
  }
}

template <class Message>
void Gate::SetDigests(Message& message) const {
  SetDigest(message.config_digest, config_digest_);
  SetDigest(message.model_digest, model_digest_);
  SetDigest(message.declaration_digest, declaration_digest_);
  SetDigest(message.observations_digest, observations_digest_);
  SetDigest(message.obstacles_digest, obstacles_digest_);
}

}  // namespace forereach
