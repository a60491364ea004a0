#include "certifier/gate/gate.h"

#include <algorithm>
#include <chrono>
#include <cstring>
#include <exception>
#include <map>
#include <span>
#include <tuple>
#include <utility>

#include <fmt/format.h>

#include "certifier/gate/advice_message.h"
#include "certifier/gate/candidate_message.h"
#include "certifier/gate/repair.h"
#include "certifier/gate/robot_messages.h"
#include "certifier/gate/stamp.h"
#include "forereach/certify/batch.h"
#include "forereach/certify/explain.h"
#include "forereach/certify/pieces.h"
#include "forereach/certify/tube.h"
#include "forereach/numerics/text.h"
#include "forereach/sets/zonotope.h"
#include "lcmtypes/candidate_batch.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "lcmtypes/why_failed.h"
#include "task/step_time.h"

namespace forereach {
namespace {

// The bus contract fixes the numbers, so they are the same on both sides.
static_assert(static_cast<int>(Outcome::kCertified) == 1 && static_cast<int>(Outcome::kSafety) == 4);
static_assert(static_cast<int>(Cause::kPairwise) == 1 &&
              static_cast<int>(Cause::kObstacle) == decision_t::CAUSE_OBSTACLE &&
              static_cast<int>(Cause::kNoStop) == decision_t::CAUSE_NO_STOP &&
              static_cast<int>(Cause::kLimit) == decision_t::CAUSE_LIMIT &&
              static_cast<int>(Cause::kBetween) == decision_t::CAUSE_BETWEEN &&
              static_cast<int>(Cause::kBound) == decision_t::CAUSE_BOUND);

// Puts a text before what SetText wrote; what no longer fits is cut off, as there.
template <std::size_t N>
void Prepend(std::string_view text, std::uint8_t (&field)[N]) {
  const std::size_t size = std::min(text.size(), N - 1);
  std::memmove(field + size, field, N - 1 - size);
  std::memcpy(field, text.data(), size);
}

std::optional<RobotMotion> MotionOf(const Config& config) {
  try {
    if (!config.laws.stop.empty()) return RobotMotion(config, Braking::kPlanned);
  } catch (const ConfigError&) {  // it does not say what being at rest is, either
  }
  return std::nullopt;
}

}  // namespace

// The parts of a candidate that is judged once more, and whether it is judged as before.
struct Gate::Again {
  Plan plan;
  Zonotope initial_set;
  Decision verdict;
};

// The last candidate that was certified, and when.
struct Gate::Rehearsal {
  std::vector<std::uint8_t> bytes;
  std::int64_t utime = 0;
};

Gate::Gate(const Config& config)
    : certifier_(config.problem),
      motion_(MotionOf(config)),
      tail_steps_(config.planner.tail_steps),
      options_(config.gate),
      grounds_(config.grounds),
      transitions_(config.grounds.observations),
      obstacles_(config),
      sources_(Microseconds(config.gate.max_age_ms) + Microseconds(config.gate.max_ahead_ms)),
      tube_(std::make_unique<Tube>()),
      pieces_(config.gate.max_pieces > 1 ? std::make_unique<Pieces>() : nullptr),
      rehearsal_(config.realtime.keep_warm ? std::make_unique<Rehearsal>() : nullptr) {}

Gate::~Gate() = default;

void Gate::Inherit(const Gate& before) {
  obstacles_.Inherit(before.obstacles_);
  sources_.Inherit(before.sources_);
  decisions_ = before.decisions_;
  certificates_ = before.certificates_;
  counts_ = before.counts_;
  // What the old gate had learned is not in this one's observations, which are those of the file.
  counts_.learned = 0;
}

GateAnswer Gate::Decide(Bytes candidate, const TimeSource& clock) noexcept {
  return Answer(candidate, clock, std::nullopt);
}

GateAnswer Gate::Decide(Bytes candidate, std::int64_t now_us) noexcept {
  return Answer(
      candidate, [now_us] { return now_us; }, std::nullopt);
}

GateAnswer Gate::Refuse(Bytes candidate, std::int64_t now_us, std::int16_t cause, const std::string& why,
                        std::int16_t outcome) noexcept {
  return Answer(
      candidate, [now_us] { return now_us; }, Rejection{cause, why, outcome});
}

GateAnswer Gate::Answer(Bytes message, const TimeSource& clock, std::optional<Rejection> from_outside) noexcept {
  const std::int64_t now_us = clock();
  std::vector<std::uint8_t> chosen;
  std::string how;
  try {
    if (IsBatch(message)) std::tie(chosen, how) = ChooseIn(message, now_us, clock, from_outside.has_value());
  } catch (const std::exception& error) {
    from_outside = Rejection{decision_t::CAUSE_INTERNAL_ERROR, fmt::format("internal error: {}", WhyFailed(error))};
  }
  GateAnswer answer = AnswerOne(chosen.empty() ? message : Bytes(chosen), now_us, clock, std::move(from_outside));
  if (!how.empty()) Prepend(how, answer.decision.message);
  return answer;
}

// A function of its own, as RefuseBatch: a decoded batch takes 62 kB of stack, which the decision on a candidate would
// then lie below.
std::pair<std::vector<std::uint8_t>, std::string> Gate::ChooseIn(Bytes message, std::int64_t now_us,
                                                                 const TimeSource& clock, bool is_refused) {
  const auto batch = Decoded<candidate_batch_t>(message);
  if (!batch || !WhyNoBatch(*batch).empty()) return {};
  // A batch that is refused anyway is answered by its first candidate: nobody may have the gate certify hundreds of
  // plans that it will not pass on.
  Choice choice = is_refused ? Choice{} : Choose(*batch, now_us, clock);
  return {Encode(CandidateOf(*batch, choice.candidate)), std::move(choice.how)};
}

// Whatever it chooses is decided on by itself: this search proves nothing.
Gate::Choice Gate::Choose(const candidate_batch_t& batch, std::int64_t now_us, const TimeSource& clock) {
  const int count = batch.num_candidates;
  const auto at = [count](int k) { return fmt::format("candidate {} of 0..{}: ", k, count - 1); };
  candidate_plan_t candidate{};
  Zonotope initial_set;
  std::vector<Plan> plans;
  for (int k = 0; k < count; ++k) {
    candidate = CandidateOf(batch, k);
    // The refusal names the candidate that is wrong.
    if (CheckContent(candidate, initial_set) || sources_.IsUsed(candidate, now_us)) return {k, at(k)};
    plans.push_back(PlanOf(batch, k, ScheduleOf(candidate, options_)));
  }
  if (CheckTimes(candidate, now_us) || !WhyNoSchedule(candidate, options_).empty() || CheckDeadline(candidate, now_us))
    return {0, at(0)};
  certifier_.Require(plans[0], initial_set, obstacles_.indexed());
  const auto decisions = CertifyAll(certifier_, plans, std::span(&initial_set, 1), obstacles_.indexed(),
                                    {.until_certified = true,
                                     .clock = clock,
                                     // The other half is for the decision on the one that is chosen.
                                     .deadline = now_us + Microseconds(options_.decision_budget_ms) / 2,
                                     .tubes = std::span(tube_.get(), 1)});
  const auto certified = std::ranges::find(decisions, Outcome::kCertified, &Decision::outcome) - decisions.begin();
  if (certified < count) return {static_cast<int>(certified), at(static_cast<int>(certified))};
  std::map<std::string, int> causes;
  for (const Decision& decision : decisions)
    ++causes[decision.outcome == Outcome::kNone ? "not judged"
                                                : std::string(CauseName(static_cast<std::int16_t>(decision.cause)))];
  std::string counts;
  for (const auto& [cause, number] : causes)
    counts += fmt::format("{}{} {}", counts.empty() ? "" : ", ", cause, number);
  return {0, fmt::format("none of {} ({}); the first: ", count, counts)};
}

GateAnswer Gate::AnswerOne(Bytes bytes, std::int64_t now_us, const TimeSource& clock,
                           std::optional<Rejection> from_outside) noexcept {
  GateAnswer answer;
  decision_t& decision = answer.decision;
  decision.utime = now_us;
  decision.sequence = decisions_++;
  // Fails closed: whatever ends this early, as memory does, has refused.
  decision.outcome = decision_t::REJECTED;
  decision.cause = decision_t::CAUSE_INTERNAL_ERROR;
  decision.step = decision.coordinate = decision.obstacle = -1;
  decision.first_observation = decision.second_observation = -1;
  SetGrounds(decision, grounds());
  SetDigest(decision.plan_digest, PlanDigest(bytes));
  try {
    candidate_plan_t candidate{};
    Zonotope initial_set;
    std::optional<Rejection> rejection = Admit(bytes, candidate, initial_set, now_us);
    // The candidate's own defects take precedence: its sender can do something about them.
    if (!rejection) rejection = std::move(from_outside);
    if (!rejection) rejection = CheckDeadline(candidate, now_us);
    decision.candidate_utime = candidate.utime;
    decision.plan_id = candidate.plan_id;
    std::ranges::copy(candidate.source, decision.source);
    if (rejection) {
      decision.outcome = rejection->outcome;
      decision.cause = rejection->cause;
      SetText(decision.message,
              (rejection->outcome == decision_t::REJECTED ? "rejected: " : "abstained: ") + rejection->why);
    } else {
      Certify(candidate, initial_set, clock, answer);
      DropIfLate(answer, clock());
      if (rehearsal_ && answer.certified) {
        rehearsal_->bytes.assign(bytes.begin(), bytes.end());
        rehearsal_->utime = now_us;
      }
    }
  } catch (const std::exception& error) {
    decision.outcome = decision_t::REJECTED;
    decision.cause = decision_t::CAUSE_INTERNAL_ERROR;
    SetText(decision.message, fmt::format("rejected: internal error: {}", WhyFailed(error)));
    answer.certified.reset();
  }
  if (answer.certified) ++certificates_;
  Count(decision);
  return answer;
}

template <class Message>
std::optional<Gate::Rejection> Gate::CheckBytes(Bytes bytes, Message& message) {
  switch (Decode(bytes, message)) {
    case DecodeStatus::kOk: return std::nullopt;
    case DecodeStatus::kUnknownFingerprint:
      return Rejection{decision_t::CAUSE_UNKNOWN_FINGERPRINT, "not a candidate_plan_t or a candidate_batch_t"};
    case DecodeStatus::kTrailingBytes:
    case DecodeStatus::kWrongLength: break;
  }
  return Rejection{
      bytes.size() > EncodedSize<Message>() ? decision_t::CAUSE_TRAILING_BYTES : decision_t::CAUSE_WRONG_LENGTH,
      fmt::format("{} bytes, must be {}", bytes.size(), EncodedSize<Message>())};
}

Gate::Rejection Gate::RefuseBatch(Bytes bytes) {
  candidate_batch_t batch;
  if (auto rejection = CheckBytes(bytes, batch)) return *std::move(rejection);
  return {decision_t::CAUSE_WRONG_DIMENSION, fmt::format("batch: {}", WhyNoBatch(batch))};
}

std::optional<Gate::Rejection> Gate::Admit(Bytes bytes, candidate_plan_t& candidate, Zonotope& initial_set,
                                           std::int64_t now_us) {
  if (IsBatch(bytes)) return RefuseBatch(bytes);  // one that stands for candidates comes here by them
  if (auto rejection = CheckBytes(bytes, candidate)) return rejection;
  // Counted before it is judged: a gap is a loss also if what came is refused.
  sources_.Hear(candidate, now_us);
  if (auto rejection = CheckContent(candidate, initial_set)) return rejection;
  if (auto rejection = CheckTimes(candidate, now_us)) return rejection;
  if (std::string why = WhyNoSchedule(candidate, options_); !why.empty())
    return Rejection{decision_t::CAUSE_WRONG_DIMENSION, std::move(why)};
  // Last, because it uses up the plan_id: a candidate with a defect may be sent again under its number.
  return CheckSource(candidate, now_us);
}

std::optional<Gate::Rejection> Gate::CheckContent(const candidate_plan_t& candidate, Zonotope& initial_set) const {
  const NominalModel& model = *certifier_.problem().model;
  const int states = candidate.num_states, steps = candidate.num_steps;
  const auto misfit = certifier_.FindMisfit(PlanOf(candidate));
  if (states != model.num_states() || candidate.progress_steps < 0 || candidate.progress_steps > steps ||
      (misfit && misfit->kind == Certifier::Misfit::Kind::kSize))
    return Rejection{decision_t::CAUSE_WRONG_DIMENSION,
                     fmt::format("{} states, {} inputs, {} of {} steps; the task has {} and {}, at most {} steps",
                                 states, candidate.num_inputs, candidate.progress_steps, steps, model.num_states(),
                                 model.num_inputs(), kMaxSteps)};
  if (misfit) return Rejection{decision_t::CAUSE_NON_FINITE, misfit->what};
  try {
    initial_set = InitialSetOf(candidate);
  } catch (const std::invalid_argument& error) {
    return Rejection{decision_t::CAUSE_NON_FINITE, fmt::format("initial set: {}", error.what())};
  }
  return std::nullopt;
}

std::string Gate::CheckFresh(std::int64_t utime, std::int64_t now_us) const {
  return CheckStamp(utime, now_us, options_).fault;
}

std::optional<Gate::Rejection> Gate::CheckTimes(const candidate_plan_t& candidate, std::int64_t now_us) const {
  const std::int64_t lifetime = Microseconds(options_.certificate_lifetime_ms);
  const Stamp stamp = CheckStamp(candidate.utime, now_us, options_);
  if (stamp.freshness != Freshness::kFresh)
    return Rejection{stamp.freshness == Freshness::kStale ? decision_t::CAUSE_STALE : decision_t::CAUSE_FUTURE,
                     stamp.fault};
  switch (FreshnessOf(candidate.start_utime, now_us, 0, lifetime)) {
    case Freshness::kStale:
      return Rejection{decision_t::CAUSE_TOO_LATE,
                       fmt::format("its start was {} ago", Milliseconds(now_us, candidate.start_utime))};
    // Its certificate would have expired before its start.
    case Freshness::kFuture:
      return Rejection{decision_t::CAUSE_FUTURE, fmt::format("starts in {}, a certificate lives {} ms",
                                                             Milliseconds(candidate.start_utime, now_us),
                                                             ToText(options_.certificate_lifetime_ms))};
    case Freshness::kFresh: return std::nullopt;
  }
  return std::nullopt;
}

std::optional<Gate::Rejection> Gate::CheckSource(const candidate_plan_t& candidate, std::int64_t now_us) {
  switch (sources_.Admit(candidate, now_us)) {
    case Sources::Admission::kNew: return std::nullopt;
    case Sources::Admission::kUsed:
      return Rejection{decision_t::CAUSE_DUPLICATE,
                       fmt::format("plan_id {} was used by this source, or is too far below its highest, {}",
                                   candidate.plan_id, sources_.HighestPlanId(candidate))};
    case Sources::Admission::kTooManySources: break;
  }
  return Rejection{decision_t::CAUSE_TOO_MANY_SOURCES,
                   fmt::format("more than {} sources send candidates", Sources::kMaxSources)};
}

std::int64_t Gate::EarliestStart(std::int64_t now_us) const {
  const std::int64_t budget_us = Microseconds(options_.decision_budget_ms);
  // A clock may show any number, and no sum may overflow.
  return now_us > INT64_MAX - budget_us ? INT64_MAX : now_us + budget_us;
}

std::optional<Gate::Rejection> Gate::CheckDeadline(const candidate_plan_t& candidate, std::int64_t now_us) const {
  if (candidate.start_utime >= EarliestStart(now_us)) return std::nullopt;
  return Rejection{decision_t::CAUSE_DEADLINE,
                   fmt::format("it starts in {} ms, a decision may take {} ms",
                               ToText(static_cast<double>(candidate.start_utime - now_us) / 1e3),
                               ToText(options_.decision_budget_ms)),
                   decision_t::ABSTAIN_DEADLINE};
}

void Gate::Certify(const candidate_plan_t& candidate, const Zonotope& initial_set, const TimeSource& clock,
                   GateAnswer& answer) {
  const Plan plan = PlanOf(candidate, ScheduleOf(candidate, options_));
  certifier_.Require(plan, initial_set, obstacles_.indexed());
  Decision verdict = certifier_.Certify(plan, initial_set, obstacles_.indexed(), *tube_);
  decision_t& decision = answer.decision;
  std::string how;
  if (pieces_ && verdict.outcome == Outcome::kSafety) {
    const std::int64_t deadline = decision.utime + Microseconds(options_.decision_budget_ms) / 2;
    // A certificate that comes too late is dropped, so no piece is begun that may end after half of the budget.
    std::int64_t last = decision.utime, longest = 0;
    const auto goes_on = [&] {
      const std::int64_t now = clock();
      longest = std::max(longest, now - std::exchange(last, now));
      return now + longest <= deadline;
    };
    const Decision in_pieces = pieces_->Certify(certifier_, plan, initial_set, obstacles_.indexed(), verdict,
                                                options_.max_pieces, goes_on, *tube_);
    const bool is_certified = in_pieces.outcome == Outcome::kCertified;
    how = is_certified ? CertifiedInPieces(pieces_->count()) : AlsoInPieces(pieces_->trials());
    if (is_certified) verdict = in_pieces;
  }

  decision.outcome = static_cast<std::int16_t>(verdict.outcome);
  decision.cause = static_cast<std::int16_t>(verdict.cause);
  decision.step = static_cast<std::int16_t>(verdict.step);
  decision.coordinate = static_cast<std::int16_t>(verdict.coordinate);
  decision.obstacle = static_cast<std::int16_t>(verdict.obstacle);
  decision.first_observation = verdict.first_observation;
  decision.second_observation = verdict.second_observation;
  decision.margin = verdict.margin;
  decision.threshold = verdict.threshold;
  const std::string sentence = Explain(verdict, certifier_, obstacles_.all(), plan, *tube_) + how;
  SetText(decision.message, sentence);
  if (verdict.outcome != Outcome::kCertified) return;
  // In shadow mode no certificate is made, so none can be taken for one (docs/decisions.md).
  if (!options_.shadow) return Attest(candidate, decision, answer.certified.emplace());
  decision.outcome = decision_t::REJECTED;
  decision.cause = decision_t::CAUSE_SHADOW;
  SetText(decision.message, fmt::format("rejected: shadow mode; else: {}", sentence));
}

Standing Gate::JudgeAgain(const candidate_plan_t& candidate, const Upheld& upheld, int first_step) noexcept {
  try {
    // The task may have been read again, with another dt, more exact steps or less exact states.
    if (!WhyNoSchedule(candidate, options_).empty()) return {};
    if (!upheld.Suffices(UpheldUnder(certifier_.problem(), options_))) return {};
    const Plan plan = PlanOf(candidate, ScheduleOf(candidate, options_));
    const Zonotope initial_set = InitialSetOf(candidate);
    certifier_.Require(plan, initial_set, obstacles_.indexed());
    const Standing whole =
        forereach::JudgeAgain(certifier_, plan, initial_set, obstacles_.indexed(), *tube_, first_step);
    if (!pieces_ || whole.verdict.outcome != Outcome::kSafety) return whole;
    // A withdrawal waits for it no longer than a plan waits for its decision.
    const auto end =
        std::chrono::steady_clock::now() + std::chrono::microseconds(Microseconds(options_.decision_budget_ms));
    const Decision in_pieces = pieces_->Certify(
        certifier_, plan, initial_set, obstacles_.indexed(), whole.verdict, options_.max_pieces,
        [&] { return std::chrono::steady_clock::now() < end; }, *tube_, first_step);
    return in_pieces.outcome == Outcome::kCertified ? Standing{plan.num_steps, in_pieces} : whole;
  } catch (const std::exception&) {
    // Nothing stands: a withdrawal that is not needed costs a stop, one that is missing more.
    return {};
  }
}

void Gate::KeepWarm() noexcept {
  if (!rehearsal_ || rehearsal_->bytes.empty()) return;
  const auto& [bytes, now_us] = *rehearsal_;
  try {
    GateAnswer answer;  // where the next one will be, about: its memory counts, too
    answer.decision.utime = now_us;
    SetGrounds(answer.decision, grounds());
    SetDigest(answer.decision.plan_digest, PlanDigest(bytes));
    candidate_plan_t candidate{};
    Zonotope initial_set;
    if (CheckBytes(bytes, candidate) || CheckContent(candidate, initial_set) || CheckTimes(candidate, now_us)) return;
    // By a clock that leaves no time for pieces.
    Certify(
        candidate, initial_set, [] { return INT64_MAX / 2; }, answer);
    static_cast<void>(Encode(answer.decision));
    if (answer.certified) static_cast<void>(Encode(*answer.certified));
  } catch (const std::exception&) {  // nobody waits for it
  }
}

std::optional<Gate::Again> Gate::CertifyAgain(const candidate_plan_t& candidate, const decision_t& decision) {
  // Advice on another world than the decision's would mislead.
  if (GroundsOf(decision) != grounds()) return std::nullopt;
  Again again{PlanOf(candidate, ScheduleOf(candidate, options_)), InitialSetOf(candidate), {}};
  certifier_.Require(again.plan, again.initial_set, obstacles_.indexed());
  again.verdict = certifier_.Certify(again.plan, again.initial_set, obstacles_.indexed(), *tube_);
  if (static_cast<int>(again.verdict.cause) != decision.cause || again.verdict.step != decision.step)
    return std::nullopt;
  return again;
}

advice_t Gate::AdviceOn(const candidate_plan_t& candidate, const decision_t& decision) const {
  advice_t advice{};
  advice.candidate_utime = candidate.utime;
  advice.plan_id = candidate.plan_id;
  std::ranges::copy(candidate.source, advice.source);
  std::ranges::copy(decision.plan_digest, advice.plan_digest);
  advice.outcome = decision.outcome;
  advice.cause = decision.cause;
  SetGrounds(advice, grounds());
  return advice;
}

std::optional<advice_t> Gate::Advise(const candidate_plan_t& candidate, const decision_t& decision,
                                     const SearchEffort& effort) noexcept {
  try {
    if (!effort.goes_on()) return std::nullopt;
    const std::optional<Again> again = CertifyAgain(candidate, decision);
    if (!again) return std::nullopt;
    const std::vector<advice_change_t> changes =
        ChangesFor({certifier_, again->plan, again->initial_set, obstacles_.indexed(), again->verdict}, *tube_, effort);
    if (changes.empty()) return std::nullopt;
    advice_t advice = AdviceOn(candidate, decision);
    advice.num_changes = static_cast<std::int16_t>(changes.size());
    std::ranges::copy(changes, advice.change);
    return advice;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

std::optional<advice_t> Gate::Repair(const candidate_plan_t& candidate, const decision_t& decision,
                                     const std::function<bool()>& goes_on) noexcept {
  try {
    if (!AsksForRepair(candidate, decision) || !goes_on()) return std::nullopt;
    const std::optional<Again> again = CertifyAgain(candidate, decision);
    if (!again || candidate.progress_steps < 0 || candidate.progress_steps > candidate.num_steps) return std::nullopt;
    advice_t advice = AdviceOn(candidate, decision);
    const auto repair =
        FindRepair({certifier_, again->plan, again->initial_set, obstacles_.indexed(), again->verdict},
                   candidate.progress_steps, {motion_ ? &*motion_ : nullptr, tail_steps_}, *tube_, goes_on);
    if (repair) SetProposal(*repair, candidate, advice);
    return advice;
  } catch (const std::exception&) {
    return std::nullopt;
  }
}

// Should the budget not have been enough: its execution might begin before the robot has it.
void Gate::DropIfLate(GateAnswer& answer, std::int64_t now_us) const {
  const std::int64_t taken = now_us - answer.decision.utime;
  if (!answer.certified || taken <= Microseconds(options_.decision_budget_ms)) return;
  answer.certified.reset();
  answer.decision.outcome = decision_t::ABSTAIN_DEADLINE;
  answer.decision.cause = decision_t::CAUSE_OVERRUN;
  SetText(answer.decision.message,
          fmt::format("abstained: the decision took {} ms, it may take {} ms", ToText(static_cast<double>(taken) / 1e3),
                      ToText(options_.decision_budget_ms)));
}

void Gate::Attest(const candidate_plan_t& candidate, const decision_t& decision, certified_plan_t& certified) {
  certified.utime = decision.utime;
  certified.sequence = certificates_;
  certified.expires_utime = decision.utime + Microseconds(options_.certificate_lifetime_ms);
  certified.plan = candidate;
  for (int t = 0; t <= candidate.num_steps; ++t) {
    for (int k = 0; k < candidate.num_states; ++k) {
      // Outward-rounded: the robot compares its state with these, and a state in X_t must not look like one that has
      // left.
      const Interval hull = tube_->hull(t, k);
      certified.slice_lower[t][k] = hull.lower;
      certified.slice_upper[t][k] = hull.upper;
    }
  }
  std::ranges::copy(decision.plan_digest, certified.plan_digest);
  SetUpheld(certified, UpheldUnder(certifier_.problem(), options_));
  SetGrounds(certified, grounds());
  SetDigest(certified.transitions_digest, transitions_);
  // Last: the seal covers everything above, so a guard notices what was changed afterwards.
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
}

std::string Gate::UpdateObstacles(Bytes bytes, std::int64_t now_us, SenderId sender) {
  return obstacles_.Update(bytes, now_us, sender);
}

std::string Gate::CheckRobotState(const robot_state_t& state, std::int64_t now_us) const {
  const Problem& problem = certifier_.problem();
  std::string fault = FaultOf(state, problem.model->num_states());
  if (fault.empty()) fault = WiderThanDeclared(state, problem);
  return fault.empty() ? CheckFresh(state.utime, now_us) : fault;
}

std::string Gate::Learn(Bytes bytes) {
  if (!options_.learns) return "the task has gate.learn: none";
  const auto message = Decoded<transition_t>(bytes);
  if (!message) return fmt::format("not a transition_t of {} bytes", EncodedSize<transition_t>());
  const Problem& problem = certifier_.problem();
  const ExecutedTransition transition = FromMessage(*message, problem, options_);
  // Without a clock, a step whose duration does not count is passed over: it is no error.
  const bool is_any = !StepErrorUs(options_);
  if (is_any && !CountedDuration(problem, transition.by_clock, true)) return {};
  if (!transition.refusal.empty()) return transition.refusal;
  const Learned learned = certifier_.Learn(transition.z, transition.next, transition.longer, transition.by_clock);
  if (is_any && transition.longer > 0 && (learned == Learned::kNoNominalSlope || learned == Learned::kAmbiguousAngle))
    return {};
  if (learned != Learned::kAdded) return Explain(learned);
  // A reader of the log learns the same messages in the same order, and finds the same digest.
  grounds_.observations = ChainedDigest(grounds_.observations, bytes);
  ++counts_.learned;
  return {};
}

certifier_status_t Gate::Status(std::int64_t now_us) const {
  certifier_status_t status = counts_;
  status.utime = now_us;
  status.shadow = options_.shadow;
  status.candidates_lost = sources_.lost();
  status.observations = static_cast<std::int64_t>(certifier_.num_observations());
  status.obstacles_source = options_.obstacles == ObstaclesSource::kBus ? certifier_status_t::OBSTACLES_BUS
                                                                        : certifier_status_t::OBSTACLES_TASK;
  status.obstacles_known = obstacles_.WhyUnknown(now_us).empty();
  status.obstacles_in_force = static_cast<std::int32_t>(obstacles_.all().size());
  status.obstacles_utime = obstacles_.stamp().value_or(0);
  status.obstacles_age_us = obstacles_.stamp() ? now_us - *obstacles_.stamp() : -1;
  status.obstacles_lost = obstacles_.lost();
  SetGrounds(status, grounds());
  return status;
}

void Gate::Count(const decision_t& decision) {
  ++counts_.candidates;
  ++counts_.by_outcome[decision.outcome];
  ++counts_.by_cause[decision.cause];
  counts_.consecutive_failures = decision.outcome == decision_t::CERTIFIED ? 0 : counts_.consecutive_failures + 1;
}

Grounds Gate::grounds() const {
  Grounds grounds = grounds_;
  grounds.obstacles = obstacles_.digest();
  return grounds;
}

}  // namespace forereach
