/** The execution guard. A robot that links it executes only certified plans.

The guard checks each certified plan itself and uses no part of the certifier. The robot passes it every message of
PLAN_CERTIFIED and, at every step boundary, its measured state:

    Accept    -> the plan is pending and waits for its start; a newer plan replaces it
    TryStart  -> at the plan's start boundary, with the state inside X_0: the plan executes from step 0 and replaces
                 the plan before it
    Check     -> after each control: the state has not left X_t, so the next control may be applied; the step is on
                 time and has not lasted too long, unless the plan's step_error_us is -1
    CheckAgain -> the same once more, if time has passed since Check
    Withdraw  -> controls of a plan stand no longer: a pending plan is dropped, and of the executing one only the
                 controls before `standing_steps` may still be applied
    Finish    -> no plan is executing
    Halt      -> no plan is executing, and none is accepted or started until Reset

Every refusal is final. A plan that TryStart refuses for another cause than an early start is discarded. A plan whose
Check fails stops executing. If Check finds that a slice was left, the guard halts itself, because an assumption of the
next certificate is false too. A step that is off its schedule only ends the plan: TryStart looks at the time of the
next one. Apply only what `control` returns.

The plan says what it was certified for, under its seal: its step_error_us is how far a step may be off its time, its
state_error how far the true state may be from a measured one. So a guard always upholds what its plan rests on.

The measured state is not the true one: the true state is anywhere in measured +- state_error, the plan's or that of
this measurement. A plan starts only if all
of that lies inside X_0. A slice is left if none of it lies in the slice. In between, the measurement is consistent with
the certificate, which holds for the true state if the plan began inside X_0 and its assumptions are true.

Check compares with interval hulls: a certified_plan_t contains, for t = 0..T, the interval hull of the certified
slice X_t, rounded outward. X_t lies in its hull. So a state outside the hull has left X_t, and the certificate does not
cover it. The guard uses hulls instead of zonotopes because 4n comparisons of sums suffice. A state that is an angle
may differ by whole turns (GuardOptions::angles); then it has to be inside by more than the rounding of the turns.

Plan ids of all sources are compared with each other, because a robot follows one planner. Single-threaded. */
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bus/authentic.h"
#include "forereach/certified_plan_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/angle.h"
#include "lcmtypes/codec.h"

namespace forereach {

/** The cause of a refusal. Records contain the names (GuardCauseName), not the numbers. */
enum class GuardCause {
  kNone,
  // Accept
  kUnsigned,           ///< With keys: there is no signature.
  kForged,             ///< With keys: the signature is not that of this robot's certifier over these bytes.
  kForeign,            ///< With keys: the signature is for another bus.
  kSignatureReplayed,  ///< With keys: the signed message was received before.
  kSignedBefore,       ///< With keys: it was signed before this guard heard anything.
  kSignedAhead,        ///< With keys: it was signed further ahead of this robot's clock than the channel allows.
  kWrongLength,
  kTrailingBytes,
  kUnknownFingerprint,
  kWrongDimension,     ///< The numbers of states and inputs are not this robot's, or the steps are out of range.
  kWrongStepPeriod,    ///< step_us is not this robot's.
  kZeroDigest,         ///< A digest is all zero, so it is not the digest of anything.
  kPlanDigest,         ///< plan_digest is not the digest of the embedded candidate.
  kCertificateDigest,  ///< certificate_digest is not the digest of the message.
  kUnusedEntry,        ///< An unused slice entry is not zero. No digest covers it.
  kNonFinite,      ///< NaN or infinity in a control, X_0, a slice or state_error, or a negative half-width or error.
  kEmptySlice,     ///< A slice has lower > upper.
  kOutsideDomain,  ///< A slice before the last, X_0 or a control leaves GuardOptions::domain.
  kExpired,        ///< Also from TryStart.
  kConfigDigest,   ///< Certified under another configuration.
  kModelDigest,    ///< Certified for another model.
  kReplayed,  ///< plan_id is the executing plan's, or not above the last accepted one while an accepted plan may be
              ///< valid.
  // Accept and TryStart
  kHalted,  ///< Until Reset.
  // TryStart
  kNothingPending,
  kTooEarly,  ///< The plan stays pending.
  kTooLate,
  kOutsideInitialSet,
  // TryStart and Check
  kOffSchedule,  ///< Further than the plan's step_error_us from start_utime + step * step_us, from the first step's
                 ///< time + step * step_us, or from step_us after the last step.
  kWrongStateSize,
  kWrongStateError,  ///< An error of the state is negative or not finite, or there is not one for each state.
  kOutsideSlice,     ///< The slice was left.
  // Check
  kNotExecuting,
  kStepOutOfOrder,  ///< Not the step after the last one checked, or past the horizon.
  kWithdrawn,       ///< The control before this step had been withdrawn.
  // all of them
  kInternalError,  ///< An exception: out of memory.
};

/** The name of a cause: "wrong_length", "trailing_bytes", ...; "none" for kNone. */
[[nodiscard]] std::string_view GuardCauseName(GuardCause cause);

/** The guard's answer. Default: accepted. */
struct GuardVerdict {
  GuardCause cause = GuardCause::kNone;
  std::int64_t plan_id = -1;  ///< The plan concerned, -1 if none or not decoded.
  int step =
      -1;  ///< Witness of kOutsideInitialSet, kOutsideSlice, kUnusedEntry, kNonFinite, kEmptySlice, kOutsideDomain.
  int coordinate =
      -1;  ///< Witness: coordinate of state, X_0, slice or control; for kOutsideDomain inputs follow states. If a slice
           ///< was not left: the first state that is consistent with it, and not inside; -1: all are inside.
  double value = 0;     ///< Witness: the value of that coordinate; for kOffSchedule the lateness in microseconds.
  double bound = 0;     ///< Witness: the violated bound, rounded to double.
  std::string message;  ///< One sentence with the values; empty for kNone.

  [[nodiscard]] bool ok() const { return cause == GuardCause::kNone; }
  /** Of Check and CheckAgain: whether all of measured +- error lies in the slice. */
  [[nodiscard]] bool is_inside() const { return ok() && coordinate < 0; }
};

/** The domain of the task: one entry for each state and each input, in the model's units. The certifier keeps every
slice except the last, and every control, inside this domain. A certified plan that leaves it is not from this
certifier. */
struct GuardDomain {
  std::vector<double> state_lower, state_upper, input_lower, input_upper;
};

/** The guard's answer to a withdrawal. */
struct GuardWithdrawal {
  GuardVerdict verdict = {};   ///< Whether the message counts, and its plan_id.
  std::int64_t sequence = -1;  ///< The message's.
  int standing_steps = 0;      ///< Controls of the plan that may still be applied: 0 unless it is executing.
  std::string message = {};    ///< The certifier's sentence.
};

struct GuardOptions {
  int num_states = 0;                        ///< 1..16
  int num_inputs = 0;                        ///< 1..8
  std::int64_t step_us = 0;                  ///< Time between two step boundaries, microseconds, positive.
  std::optional<Digest> config_digest = {};  ///< If set, plans certified under another configuration are refused.
  std::optional<Digest> model_digest = {};   ///< If set, plans certified for another model are refused.
  /** From LoadKeys(PATH, Role::kRobot). If set, plans without a signature by the certifier of these keys, for
  `bus_name` and `channel`, are refused (bus/authentic.h). */
  std::optional<KeyRing> keys = {};
  std::string bus_name = {};                 ///< For example "239.255.76.67:7667". Not empty with keys.
  std::string channel = "PLAN_CERTIFIED";    ///< The channel of certified plans.
  std::string withdrawn = "PLAN_WITHDRAWN";  ///< The channel of withdrawals.
  std::optional<GuardDomain> domain = {};    ///< If set, plans that leave it are refused.
  /** The states that are angles, the task's model.angles, by their indices: a measured state is inside X_0 or a slice
  if it is there after whole turns of these (lcmtypes/angle.h). */
  std::vector<int> angles = {};
};

/** How far the plan's start_utime may be from the boundary at which it starts: half a step, or its step_error_us if
that is less and not -1. Microseconds. */
[[nodiscard]] std::int64_t StartTolerance(const certified_plan_t& certified);

/** As Authenticator::Check's: the refusal of a message on a channel, kNone if it is authentic. */
[[nodiscard]] GuardVerdict VerdictOn(Authenticity authenticity, const std::string& channel, const Speaker& speaker);

class Guard final {
 public:
  /** @throws std::invalid_argument if an option is out of range. */
  explicit Guard(GuardOptions options);

  /** Checks one message of PLAN_CERTIFIED. If it passes, it becomes the pending plan. The checks, in order: the guard
  is not halted; with keys, the certifier's signature; exact decoding; dimensions; step period; no digest is zero; the
  seal (lcmtypes/seal.h: plan digest, certificate digest, zeros in unused entries); finite numbers; lower <= upper in
  every slice; the domain; now_us <= expires_utime; the expected config and model digests; plan_id differs from the
  executing plan's and exceeds the last accepted one, unless all accepted plans have expired, so that no plan_id blocks
  later plans for ever. The seal covers every bit of the message.
  @param certified_plan_bytes the bytes as received, with the trailer. @param now_us the robot's clock, microseconds.
  Cost: the seal takes under 0.1 ms, and with keys an Ed25519 verification as much again. A message without a genuine
  trailer costs one short keyed hash. */
  [[nodiscard]] GuardVerdict Accept(Bytes certified_plan_bytes, std::int64_t now_us) noexcept;

  /** Starts the pending plan at a step boundary if all of these hold: |start_utime - boundary_utime| <= StartTolerance;
  now_us <= expires_utime, because a delayed robot reaches a boundary late; all of measured_state +- state_error lies
  in X_0 = {x : |x - initial_center| <= initial_half_width}, compared as exact real numbers, and a part of it in the
  hull of slice 0. NaN lies in no set. With a step_error_us, boundary_utime and now_us have to be within it of
  start_utime, too. kNothingPending and kTooEarly change nothing. After any other refusal no plan is pending. The
  executing plan continues unless the new one starts. It allocates nothing if it passes.
  @param measured_state num_states entries in the model's units. @param state_error of this measurement, likewise;
  empty: the plan's. */
  [[nodiscard]] GuardVerdict TryStart(std::int64_t boundary_utime, std::int64_t now_us,
                                      std::span<const double> measured_state,
                                      std::span<const double> state_error = {}) noexcept;

  /** Checks first, with a step_error_us of the plan, |now_us - start_utime - step * step_us| <= step_error_us, the same
  from the time of TryStart, and now_us - (that of the step before, or of TryStart) <= step_us + step_error_us. Then
  checks that the state measured after control step - 1 has not left the hull of slice `step`: that a part of
  measured_state +- state_error lies in it, compared as exact real numbers. No slice says where the robot is at another
  time, so a step that is off its time halts nothing. Call it for step = 1, 2, .. T in this order. After a refusal no
  plan is executing. Cost O(n); it allocates nothing if it passes. @param now_us the robot's clock, microseconds. */
  [[nodiscard]] GuardVerdict Check(int step, std::span<const double> measured_state, std::int64_t now_us,
                                   std::span<const double> state_error = {}) noexcept;

  /** Checks the step that was checked or started last once more, before its control is applied: for a robot that lets
  time pass in between. The time as Check does, with the step that has ended; the state against X_0 and the hull of
  slice 0, or the hull of slice `step`. After a refusal no plan is executing. Cost and allocations as Check. */
  [[nodiscard]] GuardVerdict CheckAgain(std::span<const double> measured_state, std::int64_t now_us,
                                        std::span<const double> state_error = {}) noexcept;

  /** Whether the certifier counts on errors as large as these, num_states entries, as far as plans say: the executing
  plan does, so does the one accepted last, and no task is expected of which none has been accepted. Empty: true, as
  declared. */
  [[nodiscard]] bool IsDeclared(std::span<const double> state_error) const noexcept;

  /** Whether Check of the same step and time would find them on schedule, whatever the state is: the step that ends has
  lasted as long as a step may. True without an executing plan. */
  [[nodiscard]] bool IsOnSchedule(int step, std::int64_t now_us) const noexcept;

  /** Takes one message of PLAN_WITHDRAWN, also while the guard is halted. With keys, the certifier has to have signed
  it. A plan is meant if its certificate digest is the message's, or if the message names none and the plan_id is equal.
  - Pending: it is dropped.
  - Executing: only controls 0 .. valid_steps - 1 may be applied, of several messages the fewest. So a repeated or late
    message never extends what stands.
  - Neither: it is not accepted later. Until its certificate has expired, a plan_id has to exceed it (see Accept).
  Cause UNKNOWN_PLAN comes from a certifier that has not certified the plan, and does not count if the plan was
  certified under the message's configuration, model, declaration and obstacles, and the message's observations are the
  plan's `transitions_digest`: then nothing was taken back, whatever had been learned before the certificate. A
  valid_steps outside 0 .. num_steps counts as the nearest of these numbers. @param now_us as of Accept. */
  [[nodiscard]] GuardWithdrawal Withdraw(Bytes withdrawal_bytes, std::int64_t now_us) noexcept;

  /** Ends the executing plan. */
  void Finish() noexcept { executing_.reset(); }

  /** Discards all plans and accepts none until Reset. Call it if an assumption of the certificates is false. */
  void Halt() noexcept;
  /** Ends Halt. Call it only on an operator's command. */
  void Reset() noexcept { halted_ = false; }
  /** After a reload of the task: also accepts plans certified under this configuration and model. The certifier may not
  have taken the new task yet, so plans of the old one are accepted until the first plan of the new one arrives.
  @param domain the domain of these plans; nothing: the domain in force stays. @param angles likewise.
  @throws std::invalid_argument as the constructor. What throws changes nothing. */
  void Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain = {},
              const std::optional<std::vector<int>>& angles = {});
  [[nodiscard]] bool halted() const { return halted_; }

  /** The control that may be applied after the last step that passed: num_inputs entries. Empty if no plan is
  executing, if its controls are used up, or if the next one has been withdrawn. Valid as `executing` is. */
  [[nodiscard]] std::span<const double> control() const;
  /** The number of controls of the executing plan that may be applied, if some were withdrawn; nothing if none was. */
  [[nodiscard]] std::optional<int> standing_steps() const { return executing_ ? standing_steps_ : std::nullopt; }
  /** The plan whose controls may be applied, or nullptr. Valid until the next call of TryStart, Check, Finish or
  Halt. */
  [[nodiscard]] const certified_plan_t* executing() const { return executing_.get(); }
  [[nodiscard]] const certified_plan_t* pending() const { return pending_.get(); }

 private:
  using StateError = std::array<double, 16>;
  struct Task {
    Digest config, model;
    std::optional<GuardDomain> domain;
    std::optional<Angles> angles;
  };

  [[nodiscard]] GuardVerdict Authenticated(const std::string& channel, const Speaker& speaker, Bytes& bytes,
                                           std::int64_t now_us);
  void Take(const withdrawal_t& message, GuardWithdrawal& answer);
  void TakeTaskOf(const certified_plan_t& certified);
  void EndIfRefused(GuardVerdict& verdict) noexcept;
  [[nodiscard]] GuardVerdict Examine(const certified_plan_t& certified, std::int64_t now_us) const;
  [[nodiscard]] std::vector<Task>::const_iterator FindExpected(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineSizes(const candidate_plan_t& plan) const;
  [[nodiscard]] GuardVerdict ExamineNumbers(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineDomain(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineStart(std::int64_t boundary_utime, std::int64_t now_us,
                                          std::span<const double> state, std::span<const double> error) const;
  [[nodiscard]] GuardVerdict ExamineStep(int step, std::span<const double> state, std::int64_t now_us,
                                         std::span<const double> error) const;
  [[nodiscard]] std::int64_t DueAfter(std::int64_t begin, int step) const;
  [[nodiscard]] GuardVerdict ExamineTime(const certified_plan_t& certified, int step, std::int64_t now_us) const;
  [[nodiscard]] GuardVerdict ExamineAgain(std::span<const double> state, std::int64_t now_us,
                                          std::span<const double> error) const;
  [[nodiscard]] GuardVerdict ExamineDuration(int step, std::int64_t began_utime, std::int64_t now_us) const;
  [[nodiscard]] GuardVerdict ExamineMeasured(const certified_plan_t& certified, std::span<const double> state,
                                             std::span<const double>& error) const;

  GuardOptions options_;
  std::vector<Task> expected_;  // by Expect
  Angles angles_;               // of plans that are accepted now
  StateError state_error_{};    // of the plan that was accepted last
  std::optional<Authenticator> authenticator_;
  bool halted_ = false;
  std::optional<std::int64_t> last_accepted_;  // plan_id
  std::int64_t last_expiry_ = INT64_MIN;       // the latest expiry of the accepted plans
  std::unique_ptr<certified_plan_t> pending_, executing_;
  Angles pending_angles_, executing_angles_;
  int last_step_ = 0;                   // last checked step of the executing plan
  std::int64_t first_step_utime_ = 0;   // when the plan started
  std::int64_t last_step_utime_ = 0;    // when it was checked
  std::int64_t step_before_utime_ = 0;  // when the one before it was
  std::optional<int> standing_steps_;   // of the executing plan
};

}  // namespace forereach
