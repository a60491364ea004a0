/** The execution guard: what a robot links so that it executes certified plans only.

It trusts nothing but a certified plan it has checked itself, and needs nothing of the certifier. The robot hands it
every message of PLAN_CERTIFIED and, at every step boundary, its measured state:

    Accept    -> the plan is pending, its start awaited; a newer one replaces it
    TryStart  -> at the boundary its start names, with the state inside X_0: the plan is executing, at step 0,
                 in place of the one before
    Check     -> after each control: the state is inside X_t, so the next control may be applied
    Finish    -> nothing is executing
    Halt      -> nothing is executing, nothing is accepted or started until Reset

Every refusal is final: a plan refused by TryStart for anything but being early is forgotten, and a plan whose Check
failed is executing no more. A state that Check finds outside its slice halts the guard by itself: what the next
certificate rests on has just been seen not to hold. Only the plan that `executing` returns may be applied, control t
after its step t passed.

What Check compares with: a certified_plan_t carries, for t = 0..T, the interval hull of the certified slice X_t,
rounded outward. X_t lies in its hull, so a state outside the hull has left X_t and the certificate says nothing of it
any more. Hulls are compared in place of zonotopes because 2n comparisons need no arithmetic that could go wrong.

Plan ids are compared whatever their source: a robot follows one planner. Single-threaded. */
#pragma once

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
#include "lcmtypes/codec.h"

namespace forereach {

/** Why the guard refused. Numbers are not stored anywhere; names are (GuardCauseName). */
enum class GuardCause {
  kNone,
  // Accept
  kUnsigned,           ///< With keys: no signature, ...
  kForged,             ///< ... one that is not the certifier's of this robot over these bytes, ...
  kForeign,            ///< ... one that was made for another bus, ...
  kSignatureReplayed,  ///< ... or one that came before.
  kWrongLength,
  kTrailingBytes,
  kUnknownFingerprint,
  kWrongDimension,     ///< Not this robot's states or inputs, or steps outside what the type holds.
  kWrongStepPeriod,    ///< step_us is not this robot's.
  kZeroDigest,         ///< A digest is all zero: nothing was digested.
  kPlanDigest,         ///< plan_digest is not that of the embedded candidate.
  kCertificateDigest,  ///< certificate_digest is not that of the message.
  kUnusedEntry,        ///< A slice entry beyond those in use is not zero, so no digest covers it.
  kNonFinite,          ///< NaN or infinity in a control, X_0 or a slice, or a negative half-width.
  kEmptySlice,         ///< lower <= upper fails.
  kOutsideDomain,      ///< A slice before the last, X_0 or a control leaves GuardOptions::domain.
  kExpired,            ///< Also from TryStart.
  kConfigDigest,       ///< Certified under another configuration.
  kModelDigest,        ///< Certified for another model.
  kReplayed,  ///< plan_id is the executing plan's, or not newer than the last accepted one's, while one may be valid.
  // Accept and TryStart
  kHalted,  ///< Until Reset.
  // TryStart
  kNothingPending,
  kTooEarly,  ///< The plan stays pending.
  kTooLate,
  kOutsideInitialSet,
  // TryStart and Check
  kWrongStateSize,
  kOutsideSlice,
  // Check
  kNotExecuting,
  kStepOutOfOrder,  ///< Not the step after the last one checked, or past the horizon.
  // all of them
  kInternalError,  ///< Out of memory.
};

/** "wrong_length", "trailing_bytes", ... "none" if there is no cause. */
[[nodiscard]] std::string_view GuardCauseName(GuardCause cause);

/** What the guard says. Default: yes. */
struct GuardVerdict {
  GuardCause cause = GuardCause::kNone;
  std::int64_t plan_id = -1;  ///< The plan concerned, -1 if none or not decoded.
  int step =
      -1;  ///< Witness of kOutsideInitialSet, kOutsideSlice, kUnusedEntry, kNonFinite, kEmptySlice, kOutsideDomain.
  int coordinate = -1;  ///< Witness: the coordinate of state, X_0, slice or control; of kOutsideDomain inputs count on
                        ///< after the states; ...
  double value = 0;     ///< ... the value found there, ...
  double bound = 0;     ///< ... and the bound it broke, rounded to double.
  std::string message;  ///< One sentence with the values; empty if there is no cause.

  [[nodiscard]] bool ok() const { return cause == GuardCause::kNone; }
};

/** Where a robot may be certified: one entry for each state and each input. The certifier keeps every slice but the
last, and every control, inside the domain of its task: a certified plan that leaves it did not come from there. */
struct GuardDomain {
  std::vector<double> state_lower, state_upper, input_lower, input_upper;
};

struct GuardOptions {
  int num_states = 0;                   ///< 1..16
  int num_inputs = 0;                   ///< 1..8
  std::int64_t step_us = 0;             ///< Time between two step boundaries, positive.
  std::optional<Digest> config_digest;  ///< If set, plans certified under another configuration are refused.
  std::optional<Digest> model_digest;   ///< If set, plans certified for another model are refused.
  std::optional<KeyRing> keys = {};  ///< LoadKeys(PATH, Role::kRobot). If set, plans are refused that the certifier of
                                     ///< these keys did not sign (bus/authentic.h) ...
  std::string bus_name = {};         ///< ... for the bus of this name, "239.255.76.67:7667"; not empty with keys, ...
  std::string channel = "PLAN_CERTIFIED";  ///< ... and for this channel.
  std::optional<GuardDomain> domain = {};  ///< If set, plans that leave it are refused.
};

class Guard final {
 public:
  /** @throws std::invalid_argument if an option is outside its range. */
  explicit Guard(GuardOptions options);

  /** Checks one message of PLAN_CERTIFIED; if it passes, it becomes the pending plan.
  In this order: not halted, signed by the certifier where there are keys, decoded whole and nothing left over,
  dimensions, step period, no digest of zero, the seal (lcmtypes/seal.h: plan digest, certificate digest, nothing in
  what is not in use), finite numbers, lower <= upper in every slice, inside the domain, not expired (now_us <=
  expires_utime), expected config and model digest, plan_id not that of the executing plan and newer than the last
  accepted, unless all that were accepted have expired: no plan_id keeps later ones out for good. The seal covers every
  bit of the message. Cost: that of the seal, under 0.1 ms, and with keys an Ed25519 signature, as much again; of a
  message without a genuine trailer one short keyed hash.
  @param certified_plan_bytes as they came, trailer and all. @param now_us robot's clock. */
  [[nodiscard]] GuardVerdict Accept(Bytes certified_plan_bytes, std::int64_t now_us) noexcept;

  /** Starts the pending plan at a step boundary if |start_utime - boundary_utime| <= step_us / 2, it has not expired
  (now_us <= expires_utime: a robot that was held up comes to a boundary late), and the measured state lies in
  X_0 = {x : |x - initial_center| <= initial_half_width}, compared as exact real numbers, and in the hull of slice 0.
  NaN lies in nothing. kNothingPending and kTooEarly change nothing; after any other refusal nothing is pending.
  Whatever the verdict, a plan that was executing goes on unless the new one started. No allocation if it passes. */
  [[nodiscard]] GuardVerdict TryStart(std::int64_t boundary_utime, std::int64_t now_us,
                                      std::span<const double> measured_state) noexcept;

  /** Checks the state measured after control step - 1 against the hull of slice `step`. To be called for step = 1, 2,
  .. T in turn. After any refusal nothing is executing. Cost O(n), no allocation if it passes. */
  [[nodiscard]] GuardVerdict Check(int step, std::span<const double> measured_state) noexcept;

  /** The executing plan ends here. */
  void Finish() noexcept { executing_.reset(); }

  /** Something that certificates rest on does not hold: all plans are forgotten, and none is taken until Reset, which
  is for a person to call. */
  void Halt() noexcept;
  void Reset() noexcept { halted_ = false; }
  /** The task has been read again: plans certified under this configuration and for this model are accepted too. It is
  not known whether the certifier has taken it, or will: from the first such plan on, those of what was read before are
  not accepted any more.
  @param domain of these plans; nothing: the one in force stays. @throws std::invalid_argument as the constructor. */
  void Expect(const Digest& config_digest, const Digest& model_digest, std::optional<GuardDomain> domain = {});
  [[nodiscard]] bool halted() const { return halted_; }

  /** The plan whose controls may be applied, or nullptr. Valid until the next call of TryStart, Check, Finish or Halt.
   */
  [[nodiscard]] const certified_plan_t* executing() const { return executing_.get(); }
  [[nodiscard]] const certified_plan_t* pending() const { return pending_.get(); }

 private:
  struct Task {
    Digest config, model;
    std::optional<GuardDomain> domain;
  };

  [[nodiscard]] GuardVerdict Authenticated(Bytes& bytes);
  [[nodiscard]] GuardVerdict Examine(const certified_plan_t& certified, std::int64_t now_us) const;
  [[nodiscard]] std::vector<Task>::const_iterator FindExpected(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineSizes(const candidate_plan_t& plan) const;
  [[nodiscard]] GuardVerdict ExamineNumbers(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineDomain(const certified_plan_t& certified) const;
  [[nodiscard]] GuardVerdict ExamineStart(std::int64_t boundary_utime, std::int64_t now_us,
                                          std::span<const double> state) const;
  [[nodiscard]] GuardVerdict ExamineStep(int step, std::span<const double> state) const;
  [[nodiscard]] GuardVerdict ExamineStateSize(std::span<const double> state) const;

  GuardOptions options_;
  std::vector<Task> expected_;  // by Expect
  std::optional<Authenticator> authenticator_;
  bool halted_ = false;
  std::optional<std::int64_t> last_accepted_;  // plan_id
  std::int64_t last_expiry_ = INT64_MIN;       // the latest of those accepted
  std::unique_ptr<certified_plan_t> pending_, executing_;
  int last_step_ = 0;  // of the executing plan, the last one checked
};

}  // namespace forereach
