#include "robot/guard.h"

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <functional>
#include <initializer_list>
#include <new>
#include <stdexcept>

#include "lcmtypes/freshness.h"
#include "lcmtypes/grounds.h"
#include "lcmtypes/seal.h"

namespace forereach {
namespace {

constexpr std::size_t kMostExpected = 8;  // reloaded tasks without a plan yet
constexpr Speaker kStarts{Role::kCertifier}, kStops{Role::kCertifier, kStopsAheadUs};
// What a certified_plan_t has room for.
constexpr int kMaxPlanStates = 16, kMaxPlanInputs = 8, kMaxPlanSteps = 128;

// Empty without memory for it: a refusal keeps its cause.
[[gnu::format(printf, 1, 2)]] std::string Sentence(const char* format, ...) try {
  char text[256];
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  return text;
} catch (const std::bad_alloc&) {
  return {};
}

GuardVerdict Refuse(GuardCause cause, std::string message) {
  GuardVerdict verdict;
  verdict.cause = cause;
  verdict.message = std::move(message);
  return verdict;
}

GuardVerdict RefuseAt(GuardCause cause, int step, int coordinate, double value, double bound, std::string message) {
  GuardVerdict verdict = Refuse(cause, std::move(message));
  verdict.step = step;
  verdict.coordinate = coordinate;
  verdict.value = value;
  verdict.bound = bound;
  return verdict;
}

template <class Message>
GuardVerdict RefuseDecode(DecodeStatus status, std::size_t received) {
  const std::size_t expected = EncodedSize<Message>();
  if (status == DecodeStatus::kUnknownFingerprint)
    return Refuse(GuardCause::kUnknownFingerprint,
                  Sentence("the %zu bytes are not a %s", received, Message::getTypeName()));
  return Refuse(status == DecodeStatus::kTrailingBytes ? GuardCause::kTrailingBytes : GuardCause::kWrongLength,
                Sentence("%zu bytes, a %s has %zu", received, Message::getTypeName(), expected));
}

// A measured state coordinate, in words.
struct Coordinate {
  std::array<char, 100> text;

  Coordinate(std::size_t k, double x, double error) {
    const char* const format = error > 0 ? "state coordinate %zu is %.17g +- %.17g" : "state coordinate %zu is %.17g";
    std::snprintf(text.data(), text.size(), format, k, x, error);
  }
};

const char* TurnsOf(bool is_angle) { return is_angle ? " after whole turns" : ""; }

// All of the measured state +- its error has to lie in X0.
GuardVerdict CheckInitialSet(const candidate_plan_t& plan, const Angles& angles, std::span<const double> state,
                             std::span<const double> error) {
  for (std::size_t k = 0; k < state.size(); ++k) {
    const double x = state[k], center = plan.initial_center[k], half_width = plan.initial_half_width[k];
    const Ends turned = angles[k] ? TurnTowards(x, center - half_width, center + half_width) : Ends{x, x};
    // Exact sums (SumAtMost): a state that is outside by a rounding error is outside, for the proof begins in X0.
    if (SumAtMost(turned.upper, error[k], center, half_width) &&
        SumAtMost(center, -half_width, turned.lower, -error[k]))
      continue;
    const double bound = turned.lower < center ? center - half_width : center + half_width;
    return RefuseAt(GuardCause::kOutsideInitialSet, 0, static_cast<int>(k), x, bound,
                    Sentence("plan %" PRId64 ": %s, not inside X0 = %.17g +- %.17g%s", plan.plan_id,
                             Coordinate(k, x, error[k]).text.data(), center, half_width, TurnsOf(angles[k])));
  }
  return {};
}

// Refuses a state that has left the slice. An accepted one that is not inside has its first such coordinate as witness.
GuardVerdict CheckSlice(const certified_plan_t& certified, const Angles& angles, int step,
                        std::span<const double> state, std::span<const double> error) {
  GuardVerdict verdict;
  for (std::size_t k = 0; k < state.size(); ++k) {
    const double x = state[k], lower = certified.slice_lower[step][k], upper = certified.slice_upper[step][k];
    // Left only if all of the measured state +- its error is outside: a robot must not stop for its sensor's noise. X0
    // is the other way round, for it is a hypothesis of the certificate.
    const Conformance conformance = Conform(x, error[k], lower, upper, angles[k]);
    const bool has_left = conformance == Conformance::kLeft;
    if (conformance == Conformance::kInside || (!has_left && verdict.coordinate >= 0)) continue;
    const double nearest = angles[k] ? TurnTowards(x, lower, upper).lower : x;
    verdict =
        RefuseAt(GuardCause::kNone, step, static_cast<int>(k), x, nearest < lower / 2 + upper / 2 ? lower : upper, {});
    if (!has_left) continue;
    verdict.cause = GuardCause::kOutsideSlice;
    verdict.message = Sentence("plan %" PRId64 ": %s at step %d, outside [%.17g, %.17g]%s", certified.plan.plan_id,
                               Coordinate(k, x, error[k]).text.data(), step, lower, upper, TurnsOf(angles[k]));
    return verdict;
  }
  return verdict;
}

GuardVerdict CheckError(std::span<const double> error) {
  for (std::size_t k = 0; k < error.size(); ++k)
    if (!(std::isfinite(error[k]) && error[k] >= 0))
      return Refuse(
          GuardCause::kWrongStateError,
          Sentence("the error of state coordinate %zu is %.17g, it has to be finite and not negative", k, error[k]));
  return {};
}

GuardVerdict CheckExpiry(const certified_plan_t& certified, std::int64_t now_us) {
  if (now_us <= certified.expires_utime) return {};
  return Refuse(GuardCause::kExpired, Sentence("plan %" PRId64 " expired at %" PRId64 " us, now it is %" PRId64 " us",
                                               certified.plan.plan_id, certified.expires_utime, now_us));
}

GuardVerdict RefuseDigest(GuardCause cause, const char* name, const std::string& carried, const std::string& expected) {
  return Refuse(cause, Sentence("%s is %.16s.., it has to be %.16s..", name, carried.c_str(), expected.c_str()));
}

GuardVerdict CheckDigest(GuardCause cause, const char* name, const Digest& carried, const Digest& expected) {
  if (carried == expected) return {};
  return RefuseDigest(cause, name, ToHex(carried), ToHex(expected));
}

GuardVerdict CheckDigestsAreThere(const certified_plan_t& certified) {
  for (const auto& [name, digest] : std::initializer_list<std::pair<const char*, const std::uint8_t(&)[32]>>{
           {"plan_digest", certified.plan_digest},
           {"config_digest", certified.config_digest},
           {"model_digest", certified.model_digest},
           {"declaration_digest", certified.declaration_digest},
           {"observations_digest", certified.observations_digest},
           {"obstacles_digest", certified.obstacles_digest},
           {"transitions_digest", certified.transitions_digest},
           {"certificate_digest", certified.certificate_digest}})
    // A digest that nobody set would be equal to another that nobody set.
    if (GetDigest(digest) == Digest{}) return Refuse(GuardCause::kZeroDigest, Sentence("%s is zero", name));
  return {};
}

GuardVerdict CheckSeal(const certified_plan_t& certified) {
  const std::vector<SealFault> faults = FindSealFaults(certified);
  if (faults.empty()) return {};
  const SealFault& fault = faults.front();
  const char* field = fault.field.c_str();
  switch (fault.kind) {
    case SealFault::Kind::kPlanDigest: return RefuseDigest(GuardCause::kPlanDigest, field, fault.found, fault.expected);
    case SealFault::Kind::kCertificateDigest:
      return RefuseDigest(GuardCause::kCertificateDigest, field, fault.found, fault.expected);
    case SealFault::Kind::kUnusedEntry: break;
  }
  return RefuseAt(GuardCause::kUnusedEntry, fault.step, fault.coordinate, fault.value, 0,
                  Sentence("%s is %s, it has to be %s", field, fault.found.c_str(), fault.expected.c_str()));
}

std::uint64_t Apart(std::int64_t a, std::int64_t b) {
  const auto x = static_cast<std::uint64_t>(a), y = static_cast<std::uint64_t>(b);
  // Unsigned: times are a sender's, and no difference of them may overflow.
  return a > b ? x - y : y - x;
}

bool LooksAtTime(const certified_plan_t& certified) { return certified.step_error_us >= 0; }

GuardVerdict CheckDue(const certified_plan_t& certified, int step, std::int64_t due, const char* by,
                      std::int64_t now_us) {
  const std::int64_t most = certified.step_error_us;
  const std::uint64_t apart = Apart(now_us, due);
  if (apart <= static_cast<std::uint64_t>(most)) return {};
  const bool late = now_us > due;
  return RefuseAt(GuardCause::kOffSchedule, step, -1, static_cast<double>(apart) * (late ? 1 : -1),
                  static_cast<double>(most),
                  Sentence("plan %" PRId64 ": step %d was due at %" PRId64 " us%s, it is %" PRIu64
                           " us too %s, at most %" PRId64 " us are allowed",
                           certified.plan.plan_id, step, due, by, apart, late ? "late" : "early", most));
}

}  // namespace

std::string_view GuardCauseName(GuardCause cause) {
  switch (cause) {
    case GuardCause::kNone: return "none";
    case GuardCause::kUnsigned: return "unsigned";
    case GuardCause::kForged: return "forged";
    case GuardCause::kForeign: return "foreign";
    case GuardCause::kSignatureReplayed: return "signature_replayed";
    case GuardCause::kSignedBefore: return "signed_before_the_start";
    case GuardCause::kSignedAhead: return "signed_ahead";
    case GuardCause::kWrongLength: return "wrong_length";
    case GuardCause::kTrailingBytes: return "trailing_bytes";
    case GuardCause::kUnknownFingerprint: return "unknown_fingerprint";
    case GuardCause::kWrongDimension: return "wrong_dimension";
    case GuardCause::kWrongStepPeriod: return "wrong_step_period";
    case GuardCause::kZeroDigest: return "zero_digest";
    case GuardCause::kPlanDigest: return "plan_digest";
    case GuardCause::kCertificateDigest: return "certificate_digest";
    case GuardCause::kUnusedEntry: return "unused_entry";
    case GuardCause::kNonFinite: return "non_finite";
    case GuardCause::kEmptySlice: return "empty_slice";
    case GuardCause::kOutsideDomain: return "outside_domain";
    case GuardCause::kExpired: return "expired";
    case GuardCause::kConfigDigest: return "config_digest";
    case GuardCause::kModelDigest: return "model_digest";
    case GuardCause::kReplayed: return "replayed";
    case GuardCause::kHalted: return "halted";
    case GuardCause::kNothingPending: return "nothing_pending";
    case GuardCause::kTooEarly: return "too_early";
    case GuardCause::kTooLate: return "too_late";
    case GuardCause::kOutsideInitialSet: return "outside_initial_set";
    case GuardCause::kOffSchedule: return "off_schedule";
    case GuardCause::kWrongStateSize: return "wrong_state_size";
    case GuardCause::kWrongStateError: return "wrong_state_error";
    case GuardCause::kOutsideSlice: return "outside_slice";
    case GuardCause::kNotExecuting: return "not_executing";
    case GuardCause::kStepOutOfOrder: return "step_out_of_order";
    case GuardCause::kWithdrawn: return "withdrawn";
    case GuardCause::kInternalError: return "internal_error";
  }
  return "unknown";
}

namespace {

void RequireDomain(const std::optional<GuardDomain>& domain, const GuardOptions& options) {
  if (!domain) return;
  const auto require = [](const char* what, const std::vector<double>& lower, const std::vector<double>& upper,
                          int size) {
    bool good = std::ssize(lower) == size && upper.size() == lower.size();
    for (std::size_t k = 0; good && k < lower.size(); ++k) good = lower[k] <= upper[k];
    if (!good)
      throw std::invalid_argument(std::string("GuardOptions: domain: ") + what + " has to have " +
                                  std::to_string(size) + " entries, and lower <= upper in each");
  };
  require("state", domain->state_lower, domain->state_upper, options.num_states);
  require("input", domain->input_lower, domain->input_upper, options.num_inputs);
}

}  // namespace

Guard::Guard(GuardOptions options) : options_(std::move(options)) {
  const auto require = [](const char* name, std::int64_t value, std::int64_t most) {
    if (value < 1 || value > most)
      throw std::invalid_argument(std::string("GuardOptions: ") + name + " is " + std::to_string(value) +
                                  ", it has to be 1 to " + std::to_string(most));
  };
  require("num_states", options_.num_states, kMaxPlanStates);
  require("num_inputs", options_.num_inputs, kMaxPlanInputs);
  require("step_us", options_.step_us, INT64_MAX);
  RequireDomain(options_.domain, options_);
  angles_ = AnglesOf(options_.angles, options_.num_states);
  expected_.reserve(kMostExpected);
  if (!options_.keys) return;
  if (options_.bus_name.empty()) throw std::invalid_argument("GuardOptions: bus_name has to be given with keys");
  authenticator_.emplace(*options_.keys, options_.bus_name,
                         Speakers{{options_.channel, kStarts}, {options_.withdrawn, kStops}}, std::nullopt);
}

void Guard::Halt() noexcept {
  halted_ = true;
  pending_.reset();
  executing_.reset();
}

void Guard::Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain,
                   const std::optional<std::vector<int>>& angles) {
  RequireDomain(domain, options_);
  const auto known = angles ? std::optional(AnglesOf(*angles, options_.num_states)) : std::nullopt;
  // A task that is expected again is the newest of them.
  std::erase_if(expected_,
                [&](const Task& task) { return task.config == config_digest && task.model == model_digest; });
  // Reloads without a plan in between may be many; the newest are those that plans will name.
  if (expected_.size() >= kMostExpected) expected_.erase(expected_.begin());
  expected_.push_back({config_digest, model_digest, std::move(domain), known});
}

// Checks and removes the signature.
GuardVerdict Guard::Authenticated(const std::string& channel, const Speaker& speaker, Bytes& bytes,
                                  std::int64_t now_us) {
  if (!authenticator_) return {};
  const auto [authenticity, message] = authenticator_->Check(channel, bytes, now_us);
  bytes = message;
  return VerdictOn(authenticity, channel, speaker);
}

GuardVerdict VerdictOn(Authenticity authenticity, const std::string& channel, const Speaker& speaker) {
  switch (authenticity) {
    case Authenticity::kAuthentic: return {};
    case Authenticity::kUnsigned: return Refuse(GuardCause::kUnsigned, channel + " is not signed");
    case Authenticity::kForged:
      return Refuse(GuardCause::kForged, channel + " is not signed by this robot's " + std::string(RoleName(speaker)));
    case Authenticity::kForeign: return Refuse(GuardCause::kForeign, channel + " was signed for another bus");
    case Authenticity::kOld: return Refuse(GuardCause::kSignedBefore, channel + " was signed before this start");
    case Authenticity::kAhead:
      return Refuse(
          GuardCause::kSignedAhead,
          channel + " was signed more than " + Milliseconds(speaker.max_ahead_us, 0) + " ahead of this robot's clock");
    case Authenticity::kReplayed: break;
  }
  return Refuse(GuardCause::kSignatureReplayed, "the signature on " + channel + " was used before");
}

std::int64_t StartTolerance(const certified_plan_t& certified) {
  const std::int64_t half = certified.plan.step_us / 2;
  return LooksAtTime(certified) ? std::min(half, certified.step_error_us) : half;
}

GuardVerdict Guard::Accept(Bytes certified_plan_bytes, std::int64_t now_us) noexcept {
  GuardVerdict verdict;
  try {
    if (halted_) return Refuse(GuardCause::kHalted, "halted until a person resets it");
    verdict = Authenticated(options_.channel, kStarts, certified_plan_bytes, now_us);
    if (!verdict.ok()) return verdict;
    auto certified = std::make_unique<certified_plan_t>();
    const DecodeStatus status = Decode(certified_plan_bytes, *certified);
    if (status != DecodeStatus::kOk) return RefuseDecode<certified_plan_t>(status, certified_plan_bytes.size());
    verdict = Examine(*certified, now_us);
    verdict.plan_id = certified->plan.plan_id;
    if (!verdict.ok()) return verdict;
    // Nothing below throws: either all of these change, or the plan was refused.
    last_accepted_ = certified->plan.plan_id;
    last_expiry_ = std::max(last_expiry_, certified->expires_utime);
    TakeTaskOf(*certified);
    std::ranges::copy(certified->state_error, state_error_.begin());
    pending_ = std::move(certified);
    pending_angles_ = angles_;
  } catch (...) {
    verdict.cause = GuardCause::kInternalError;
  }
  return verdict;
}

// Throws nothing: it moves what Expect has allocated.
void Guard::TakeTaskOf(const certified_plan_t& certified) {
  const auto task = expected_.begin() + (FindExpected(certified) - expected_.cbegin());
  if (task == expected_.end()) return;
  options_.config_digest = task->config;
  options_.model_digest = task->model;
  if (task->domain) options_.domain = std::move(task->domain);
  angles_ = task->angles.value_or(angles_);
  expected_.erase(expected_.begin(), task + 1);
}

namespace {

bool Names(const withdrawal_t& message, const certified_plan_t& certified) {
  const Digest named = GetDigest(message.certificate_digest);
  if (named == Digest{}) return message.plan_id == certified.plan.plan_id;
  return named == GetDigest(certified.certificate_digest);
}

// Whether a certifier that has not certified the plan has the grounds on which it was certified. Of the observations
// these are the file's transitions: to forget learned ones takes nothing back (docs/soundness.md, 3.13).
bool RestsOn(const certified_plan_t& certified, const Grounds& grounds) {
  Grounds of_plan = GroundsOf(certified);
  of_plan.observations = GetDigest(certified.transitions_digest);
  return of_plan == grounds;
}

}  // namespace

GuardWithdrawal Guard::Withdraw(Bytes withdrawal_bytes, std::int64_t now_us) noexcept {
  GuardWithdrawal answer;
  try {
    answer.verdict = Authenticated(options_.withdrawn, kStops, withdrawal_bytes, now_us);
    if (!answer.verdict.ok()) return answer;
    withdrawal_t message;
    const DecodeStatus status = Decode(withdrawal_bytes, message);
    if (status == DecodeStatus::kOk)
      Take(message, answer);
    else
      answer.verdict = RefuseDecode<withdrawal_t>(status, withdrawal_bytes.size());
  } catch (...) {
    answer.verdict.cause = GuardCause::kInternalError;
  }
  return answer;
}

void Guard::Take(const withdrawal_t& message, GuardWithdrawal& answer) {
  // Who does not know the plan says nothing against it if both have decided on the same grounds.
  const auto counts = [&](const std::unique_ptr<certified_plan_t>& plan) {
    return plan && Names(message, *plan) &&
           !(message.cause == withdrawal_t::UNKNOWN_PLAN && RestsOn(*plan, GroundsOf(message)));
  };
  if (counts(executing_)) {
    const int valid = std::clamp<int>(message.valid_steps, 0, executing_->plan.num_steps);
    standing_steps_ = std::min(standing_steps_.value_or(valid), valid);
  }
  // A pending plan needs all of its controls: it has not begun, so it never has to.
  if (counts(pending_)) pending_.reset();
  // A captured certificate of a withdrawn plan must not be accepted after its withdrawal, even if it arrives first now.
  if (message.cause != withdrawal_t::UNKNOWN_PLAN) {
    last_accepted_ = std::max(last_accepted_.value_or(message.plan_id), message.plan_id);
    last_expiry_ = std::max(last_expiry_, message.expires_utime);
  }
  answer.verdict.plan_id = message.plan_id;
  answer.sequence = message.sequence;
  if (executing_ && Names(message, *executing_))
    answer.standing_steps = standing_steps_.value_or(executing_->plan.num_steps);
  answer.message = GetText(message.message);
}

std::span<const double> Guard::control() const {
  if (!executing_) return {};
  const candidate_plan_t& plan = executing_->plan;
  if (last_step_ >= std::min<int>(plan.num_steps, standing_steps_.value_or(plan.num_steps))) return {};
  return {plan.control[last_step_], static_cast<std::size_t>(plan.num_inputs)};
}

GuardVerdict Guard::ExamineSizes(const candidate_plan_t& plan) const {
  if (plan.num_states != options_.num_states || plan.num_inputs != options_.num_inputs)
    return Refuse(GuardCause::kWrongDimension,
                  Sentence("%d states and %d inputs, this robot has %d and %d", plan.num_states, plan.num_inputs,
                           options_.num_states, options_.num_inputs));
  if (plan.num_steps < 1 || plan.num_steps > kMaxPlanSteps)
    return Refuse(GuardCause::kWrongDimension,
                  Sentence("%d steps, it has to be 1 to %d", plan.num_steps, kMaxPlanSteps));
  if (plan.progress_steps < 0 || plan.progress_steps > plan.num_steps)
    return Refuse(GuardCause::kWrongDimension,
                  Sentence("%d progress steps of %d steps", plan.progress_steps, plan.num_steps));
  if (plan.step_us != options_.step_us)
    return Refuse(GuardCause::kWrongStepPeriod,
                  Sentence("a step of %" PRId64 " us, this robot's is %" PRId64 " us", plan.step_us, options_.step_us));
  return {};
}

std::vector<Guard::Task>::const_iterator Guard::FindExpected(const certified_plan_t& certified) const {
  const Digest config = GetDigest(certified.config_digest), model = GetDigest(certified.model_digest);
  return std::ranges::find_if(expected_,
                              [&](const Task& task) { return task.config == config && task.model == model; });
}

GuardVerdict Guard::Examine(const certified_plan_t& certified, std::int64_t now_us) const {
  const candidate_plan_t& plan = certified.plan;
  GuardVerdict verdict = ExamineSizes(plan);
  if (verdict.ok()) verdict = CheckDigestsAreThere(certified);
  // Before its numbers are believed. A seal is no secret: it shows damage, the signature shows who.
  if (verdict.ok()) verdict = CheckSeal(certified);
  if (verdict.ok()) verdict = ExamineNumbers(certified);
  if (verdict.ok()) verdict = ExamineDomain(certified);
  if (verdict.ok()) verdict = CheckExpiry(certified, now_us);
  const bool expected = FindExpected(certified) != expected_.end();
  if (verdict.ok() && options_.config_digest && !expected)
    verdict = CheckDigest(GuardCause::kConfigDigest, "config_digest", GetDigest(certified.config_digest),
                          *options_.config_digest);
  if (verdict.ok() && options_.model_digest && !expected)
    verdict = CheckDigest(GuardCause::kModelDigest, "model_digest", GetDigest(certified.model_digest),
                          *options_.model_digest);
  // A captured certificate that is sent again must not start again. After its expiry none does, so older numbers may be
  // used then: a planner that began anew counts from the beginning.
  const bool executes = executing_ && plan.plan_id == executing_->plan.plan_id;
  const bool is_older = last_accepted_ && plan.plan_id <= *last_accepted_;
  if (verdict.ok() && (executes || (is_older && now_us <= last_expiry_)))
    verdict = Refuse(GuardCause::kReplayed,
                     Sentence("plan %" PRId64 " is not newer than plan %" PRId64, plan.plan_id, *last_accepted_));
  return verdict;
}

GuardVerdict Guard::ExamineNumbers(const certified_plan_t& certified) const {
  const candidate_plan_t& plan = certified.plan;
  for (int k = 0; k < options_.num_states; ++k) {
    const double center = plan.initial_center[k], half_width = plan.initial_half_width[k];
    if (!std::isfinite(center) || !(std::isfinite(half_width) && half_width >= 0))
      return RefuseAt(GuardCause::kNonFinite, 0, k, std::isfinite(center) ? half_width : center, 0,
                      Sentence("X0 in coordinate %d is %.17g +- %.17g", k, center, half_width));
    if (const double error = certified.state_error[k]; !(std::isfinite(error) && error >= 0))
      return RefuseAt(GuardCause::kNonFinite, -1, k, error, 0,
                      Sentence("state_error in coordinate %d is %.17g", k, error));
  }
  if (certified.step_error_us < -1)
    return Refuse(GuardCause::kNonFinite, Sentence("step_error_us is %" PRId64, certified.step_error_us));
  for (int t = 0; t < plan.num_steps; ++t)
    for (int i = 0; i < options_.num_inputs; ++i)
      if (const double control = plan.control[t][i]; !std::isfinite(control))
        return RefuseAt(GuardCause::kNonFinite, t, i, control, 0,
                        Sentence("control %d of step %d is %.17g", i, t, control));
  for (int t = 0; t <= plan.num_steps; ++t)
    for (int k = 0; k < options_.num_states; ++k) {
      const double lower = certified.slice_lower[t][k], upper = certified.slice_upper[t][k];
      // An infinite slice would hold every state, so that no departure were ever seen.
      const bool finite = std::isfinite(lower) && std::isfinite(upper);
      if (finite && lower <= upper) continue;
      return RefuseAt(finite ? GuardCause::kEmptySlice : GuardCause::kNonFinite, t, k, lower, upper,
                      Sentence("slice %d in coordinate %d is [%.17g, %.17g]", t, k, lower, upper));
    }
  return {};
}

// Without the last slice: no step starts from it, so the certifier does not test it against the domain.
GuardVerdict Guard::ExamineDomain(const certified_plan_t& certified) const {
  const auto task = FindExpected(certified);
  const std::optional<GuardDomain>& domain = task != expected_.end() && task->domain ? task->domain : options_.domain;
  // The robot's own domain, which no message can change: the last word even against a certifier that has been taken
  // over.
  if (!domain) return {};
  const candidate_plan_t& plan = certified.plan;
  const auto outside = [](const char* what, int t, int coordinate, double value, double bound) {
    return RefuseAt(
        GuardCause::kOutsideDomain, t, coordinate, value, bound,
        Sentence("%s %d reaches %.17g in coordinate %d, the domain ends at %.17g", what, t, value, coordinate, bound));
  };
  for (int k = 0; k < options_.num_states; ++k) {
    const double lower = domain->state_lower[static_cast<std::size_t>(k)],
                 upper = domain->state_upper[static_cast<std::size_t>(k)];
    const double center = plan.initial_center[k], half_width = plan.initial_half_width[k];
    if (!SumAtMost(center, half_width, upper, 0)) return outside("X", 0, k, center + half_width, upper);
    if (!SumAtMost(lower, 0, center, -half_width)) return outside("X", 0, k, center - half_width, lower);
    for (int t = 0; t < plan.num_steps; ++t) {
      if (!(lower <= certified.slice_lower[t][k])) return outside("slice", t, k, certified.slice_lower[t][k], lower);
      if (!(certified.slice_upper[t][k] <= upper)) return outside("slice", t, k, certified.slice_upper[t][k], upper);
    }
  }
  for (int i = 0; i < options_.num_inputs; ++i) {
    const double lower = domain->input_lower[static_cast<std::size_t>(i)],
                 upper = domain->input_upper[static_cast<std::size_t>(i)];
    for (int t = 0; t < plan.num_steps; ++t)
      if (const double control = plan.control[t][i]; !(lower <= control && control <= upper))
        return outside("control", t, options_.num_states + i, control, control < lower ? lower : upper);
  }
  return {};
}

GuardVerdict Guard::TryStart(std::int64_t boundary_utime, std::int64_t now_us, std::span<const double> measured_state,
                             std::span<const double> state_error) noexcept {
  GuardVerdict verdict;
  try {
    verdict = ExamineStart(boundary_utime, now_us, measured_state, state_error);
  } catch (...) {
    verdict.cause = GuardCause::kInternalError;
  }
  if (!pending_) return verdict;
  verdict.plan_id = pending_->plan.plan_id;
  // Every other refusal drops the plan: its start has passed, or its hypotheses do not hold.
  if (verdict.cause == GuardCause::kTooEarly) return verdict;
  if (verdict.ok()) {
    // The plan before ends here: of two plans only one has slices to which the robot is held.
    executing_ = std::move(pending_);
    executing_angles_ = pending_angles_;
    last_step_ = 0;
    first_step_utime_ = last_step_utime_ = now_us;
    standing_steps_.reset();
  }
  pending_.reset();
  return verdict;
}

GuardVerdict Guard::ExamineStart(std::int64_t boundary_utime, std::int64_t now_us, std::span<const double> state,
                                 std::span<const double> error) const {
  if (!pending_) return Refuse(halted_ ? GuardCause::kHalted : GuardCause::kNothingPending, {});
  const candidate_plan_t& plan = pending_->plan;
  if (Apart(plan.start_utime, boundary_utime) > static_cast<std::uint64_t>(StartTolerance(*pending_))) {
    const bool early = boundary_utime < plan.start_utime;
    return Refuse(early ? GuardCause::kTooEarly : GuardCause::kTooLate,
                  Sentence("plan %" PRId64 " starts at %" PRId64 " us, this boundary is %" PRId64 " us", plan.plan_id,
                           plan.start_utime, boundary_utime));
  }
  GuardVerdict verdict = CheckExpiry(*pending_, now_us);
  if (verdict.ok()) verdict = ExamineTime(*pending_, 0, now_us);
  if (!verdict.ok()) return verdict;
  verdict = ExamineMeasured(*pending_, state, error);
  if (verdict.ok()) verdict = CheckInitialSet(plan, pending_angles_, state, error);
  return verdict.ok() ? CheckSlice(*pending_, pending_angles_, 0, state, error) : verdict;
}

// An error that is not given becomes the plan's.
GuardVerdict Guard::ExamineMeasured(const certified_plan_t& certified, std::span<const double> state,
                                    std::span<const double>& error) const {
  if (std::ssize(state) != options_.num_states)
    return Refuse(GuardCause::kWrongStateSize,
                  Sentence("a state of %zu entries, this robot has %d", state.size(), options_.num_states));
  if (error.empty()) error = std::span(certified.state_error).first(state.size());
  if (error.size() != state.size())
    return Refuse(GuardCause::kWrongStateError,
                  Sentence("a state error of %zu entries, this robot has %d", error.size(), options_.num_states));
  return CheckError(error);
}

// When a step is due that begins `step` steps after `begin`. A time that no integer holds is the last one.
std::int64_t Guard::DueAfter(std::int64_t begin, int step) const {
  std::int64_t due = 0;
  // A plan's start is any number that a message has room for.
  const bool overflows =
      __builtin_mul_overflow(options_.step_us, step, &due) || __builtin_add_overflow(begin, due, &due);
  return overflows ? INT64_MAX : due;
}

GuardVerdict Guard::ExamineTime(const certified_plan_t& certified, int step, std::int64_t now_us) const {
  if (!LooksAtTime(certified)) return {};
  GuardVerdict verdict = CheckDue(certified, step, DueAfter(certified.plan.start_utime, step), "", now_us);
  // Two hypotheses of soundness 3.15: a boundary is within E of the plan's schedule, and of the first step plus t dt.
  if (!verdict.ok() || step == 0) return verdict;
  return CheckDue(certified, step, DueAfter(first_step_utime_, step), " by the first step", now_us);
}

// Of the step that ends: its motion is bounded for so long.
GuardVerdict Guard::ExamineDuration(int step, std::int64_t began_utime, std::int64_t now_us) const {
  if (!LooksAtTime(*executing_) || now_us <= began_utime) return {};
  const candidate_plan_t& plan = executing_->plan;
  const std::int64_t longer = executing_->step_error_us;
  const std::uint64_t lasted = Apart(now_us, began_utime);
  const std::uint64_t most = static_cast<std::uint64_t>(plan.step_us) + static_cast<std::uint64_t>(longer);
  if (lasted <= most) return {};
  return RefuseAt(
      GuardCause::kOffSchedule, step, -1, static_cast<double>(lasted) - static_cast<double>(plan.step_us),
      static_cast<double>(longer),
      Sentence("plan %" PRId64 ": the step before step %d lasted %" PRIu64 " us, at most %" PRIu64 " us are allowed",
               plan.plan_id, step, lasted, most));
}

bool Guard::IsDeclared(std::span<const double> state_error) const noexcept {
  if (state_error.empty()) return true;
  if (std::ssize(state_error) != options_.num_states) return false;
  const auto allows = [&](std::span<const double> declared) {
    return std::ranges::equal(state_error, declared.first(state_error.size()), std::less_equal());
  };
  return expected_.empty() && allows(state_error_) && (!executing_ || allows(executing_->state_error));
}

bool Guard::IsOnSchedule(int step, std::int64_t now_us) const noexcept {
  return !executing_ ||
         (ExamineTime(*executing_, step, now_us).ok() && ExamineDuration(step, last_step_utime_, now_us).ok());
}

GuardVerdict Guard::ExamineStep(int step, std::span<const double> state, std::int64_t now_us,
                                std::span<const double> error) const {
  if (!executing_) return Refuse(GuardCause::kNotExecuting, Sentence("no plan is executing"));
  const int num_steps = executing_->plan.num_steps;
  if (step != last_step_ + 1 || step > num_steps)
    return Refuse(GuardCause::kStepOutOfOrder, Sentence("step %d of %d after step %d", step, num_steps, last_step_));
  // The control of the step that ends was withdrawn, yet executed: only a stop is left.
  if (standing_steps_ && step > *standing_steps_)
    return Refuse(GuardCause::kWithdrawn,
                  Sentence("control %d of plan %" PRId64 " had been withdrawn", step - 1, executing_->plan.plan_id));
  // No slice says where the robot is at another time.
  GuardVerdict verdict = ExamineTime(*executing_, step, now_us);
  if (verdict.ok()) verdict = ExamineDuration(step, last_step_utime_, now_us);
  if (verdict.ok()) verdict = ExamineMeasured(*executing_, state, error);
  return verdict.ok() ? CheckSlice(*executing_, executing_angles_, step, state, error) : verdict;
}

GuardVerdict Guard::ExamineAgain(std::span<const double> state, std::int64_t now_us,
                                 std::span<const double> error) const {
  if (!executing_) return Refuse(GuardCause::kNotExecuting, Sentence("no plan is executing"));
  GuardVerdict verdict = ExamineTime(*executing_, last_step_, now_us);
  if (verdict.ok() && last_step_ > 0) verdict = ExamineDuration(last_step_, step_before_utime_, now_us);
  if (verdict.ok()) verdict = ExamineMeasured(*executing_, state, error);
  if (verdict.ok() && last_step_ == 0) verdict = CheckInitialSet(executing_->plan, executing_angles_, state, error);
  return verdict.ok() ? CheckSlice(*executing_, executing_angles_, last_step_, state, error) : verdict;
}

GuardVerdict Guard::Check(int step, std::span<const double> measured_state, std::int64_t now_us,
                          std::span<const double> state_error) noexcept {
  GuardVerdict verdict;
  try {
    verdict = ExamineStep(step, measured_state, now_us, state_error);
  } catch (...) {
    verdict.cause = GuardCause::kInternalError;
  }
  last_step_ = step;
  step_before_utime_ = std::exchange(last_step_utime_, now_us);
  EndIfRefused(verdict);
  return verdict;
}

GuardVerdict Guard::CheckAgain(std::span<const double> measured_state, std::int64_t now_us,
                               std::span<const double> state_error) noexcept {
  GuardVerdict verdict;
  try {
    verdict = ExamineAgain(measured_state, now_us, state_error);
  } catch (...) {
    verdict.cause = GuardCause::kInternalError;
  }
  last_step_utime_ = now_us;
  if (last_step_ == 0) first_step_utime_ = now_us;
  EndIfRefused(verdict);
  return verdict;
}

void Guard::EndIfRefused(GuardVerdict& verdict) noexcept {
  if (executing_) verdict.plan_id = executing_->plan.plan_id;
  // A state that has left its slice refutes an assumption, so every other certificate under it is void: a person
  // decides.
  if (verdict.cause == GuardCause::kOutsideSlice) Halt();
  if (!verdict.ok()) executing_.reset();
}

}  // namespace forereach
