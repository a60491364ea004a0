#include "torture/hostile_messages.h"

#include <initializer_list>
#include <limits>

#include "forereach/advice_t.hpp"
#include "forereach/command_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/obstacles_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "lcmtypes/seal.h"

namespace forereach {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
constexpr std::int64_t kSecondUs = 1'000'000, kHourUs = 3600 * kSecondUs;

using Messages = std::vector<RawMessage>;

template <class Value, class Set>
Messages With(const candidate_plan_t& honest, std::initializer_list<Value> values, Set set) {
  Messages made;
  for (const Value value : values) {
    candidate_plan_t candidate = honest;
    set(candidate, value);
    made.push_back(Encode(candidate));
  }
  return made;
}

Messages WithStamp(const candidate_plan_t& honest, std::initializer_list<std::int64_t> stamps) {
  return With(honest, stamps, [](candidate_plan_t& candidate, std::int64_t utime) { candidate.utime = utime; });
}

Messages WithStart(const candidate_plan_t& honest, std::initializer_list<std::int64_t> starts) {
  return With(honest, starts, [](candidate_plan_t& candidate, std::int64_t utime) { candidate.start_utime = utime; });
}

Messages WithNumbers(const candidate_plan_t& honest) {
  Messages made = With(honest, {kNan, kInf, -kInf}, [](candidate_plan_t& candidate, double value) {
    candidate.control[candidate.num_steps - 1][candidate.num_inputs - 1] = value;
  });
  for (auto& message : With(honest, {kNan, kInf}, [](auto&candidate, double x) { candidate.initial_center[0] = x; }))
    made.push_back(std::move(message));
  for (auto& message :
       With(honest, {kNan, kInf, -1e-9}, [](auto&candidate, double x) { candidate.initial_half_width[0] = x; }))
    made.push_back(std::move(message));
  return made;
}

Messages WithSizes(const candidate_plan_t& honest) {
  const auto with = [&](std::initializer_list<int> values, std::int16_t candidate_plan_t::*member) {
    return With(honest, values, [member](candidate_plan_t& candidate, int value) {
      candidate.*member = static_cast<std::int16_t>(value);
    });
  };
  Messages made = with({-32768, -1, 0, 129, 32767}, &candidate_plan_t::num_steps);
  for (auto& more : {with({-1, 0, honest.num_states + 1, 17, 32767}, &candidate_plan_t::num_states),
                     with({-1, 0, honest.num_inputs + 1, 9, 32767}, &candidate_plan_t::num_inputs),
                     with({-1, honest.num_steps + 1, 32767}, &candidate_plan_t::progress_steps)})
    made.insert(made.end(), more.begin(), more.end());
  return made;
}

Messages OtherBytes(const candidate_plan_t& honest) {
  const RawMessage bytes = Encode(honest);
  Messages made{{}, {1, 2, 3}, RawMessage(bytes.size(), 0xFF)};
  for (const std::size_t size :
       {std::size_t{7}, std::size_t{8}, bytes.size() / 2, bytes.size() - 1, bytes.size() + 1}) {
    made.push_back(bytes);
    made.back().resize(size);
  }
  made.push_back(bytes);
  made.back()[0] ^= 1;  // of the fingerprint
  return made;
}

constexpr CandidateFlaw kCandidateFlaws[] = {
    {"stale",
     [](const auto& honest, std::int64_t now) {
       return WithStamp(honest, {now - kHourUs, now - 60 * kSecondUs, 0});
     }},
    {"from the future",
     [](const auto& honest, std::int64_t now) {
       return WithStamp(honest, {now + kHourUs, now + 60 * kSecondUs});
     }},
    {"starts in the past",
     [](const auto& honest, std::int64_t now) {
       return WithStart(honest, {now - kSecondUs, now - kHourUs, 0});
     }},
    {"starts in an hour", [](const auto& honest, std::int64_t now) { return WithStart(honest, {now + kHourUs}); }},
    {"times at the ends of 64 bits",
     [](const auto& honest, std::int64_t) {
       Messages made = WithStamp(honest, {INT64_MIN, INT64_MAX});
       for (auto& message : WithStart(honest, {INT64_MIN, INT64_MAX})) made.push_back(std::move(message));
       return made;
     }},
    {"NaN, infinite or negative numbers", [](const auto& honest, std::int64_t) { return WithNumbers(honest); }},
    {"counts out of range", [](const auto& honest, std::int64_t) { return WithSizes(honest); }},
    {"cut, longer, or another type", [](const auto& honest, std::int64_t) { return OtherBytes(honest); }},
};

constexpr CertificateFlaw kCertificateFlaws[] = {
    {"expired",
     [](certified_plan_t certified, std::int64_t now) {
       certified.expires_utime = now - kSecondUs;
       return Sealed(certified);
     }},
    {"with a seal of other numbers",
     [](certified_plan_t certified, std::int64_t now) {
       certified = Sealed(Widened(certified, now));
       certified.plan.control[0][0] += 1e-3;
       return certified;
     }},
    {"with NaN in a slice",
     [](certified_plan_t certified, std::int64_t) {
       certified.slice_upper[0][0] = kNan;
       return Sealed(certified);
     }},
    {"with counts out of range",
     [](certified_plan_t certified, std::int64_t) {
       certified.plan.num_steps = 32767;
       return Sealed(certified);
     }},
    {"of another task",
     [](certified_plan_t certified, std::int64_t) {
       certified.config_digest[0] ^= 1;
       return Sealed(certified);
     }},
};

}  // namespace

std::span<const CandidateFlaw> CandidateFlaws() { return kCandidateFlaws; }
std::span<const CertificateFlaw> CertificateFlaws() { return kCertificateFlaws; }

certified_plan_t Sealed(certified_plan_t certified) {
  SetDigest(certified.plan_digest, PlanDigest(certified.plan));
  SetDigest(certified.certificate_digest, CertificateDigest(certified));
  return certified;
}

// The worst that a forged certificate could be: newer than all, soon to start, and with slices that hold every state.
certified_plan_t Widened(certified_plan_t certified, std::int64_t now_us) {
  certified.utime = now_us;
  certified.plan.plan_id += std::int64_t{1} << 32;
  certified.plan.start_utime = certified.utime + 200'000;
  certified.expires_utime = certified.utime + 1'000'000;
  for (int t = 0; t <= certified.plan.num_steps; ++t)
    for (int k = 0; k < certified.plan.num_states; ++k)
      certified.slice_lower[t][k] = -1e9, certified.slice_upper[t][k] = 1e9;
  return Sealed(certified);
}

std::map<std::string, RawMessage> HarmfulMessages(const BusOptions& channels,
                                                  const std::map<std::string, RawMessage>& heard,
                                                  const certified_plan_t* certified, std::int64_t now_us) {
  std::map<std::string, RawMessage> harmful;
  for (const auto& [channel, raw] : heard) {
    const Bytes message = WithoutSignature(raw);
    harmful[channel].assign(message.begin(), message.end());
  }
  command_t command{};
  command.utime = now_us;
  command.kind = command_t::RELOAD;
  harmful[channels.command] = Encode(command);
  fault_t fault{};
  fault.utime = now_us;
  fault.cause = fault_t::SLICE_LEFT;
  harmful[channels.fault] = Encode(fault);
  withdrawal_t withdrawal{};
  withdrawal.sequence = kForgedSequence;
  withdrawal.expires_utime = INT64_MAX;
  if (certified) withdrawal.plan_id = certified->plan.plan_id;
  harmful[channels.withdrawn] = Encode(withdrawal);
  advice_t advice{};
  advice.sequence = kForgedSequence;
  advice.num_changes = 1;
  advice.changed = 1;
  harmful[channels.advice] = Encode(advice);
  obstacles_t nothing_there{};
  nothing_there.utime = now_us;
  nothing_there.sequence = kForgedSequence;
  harmful[channels.obstacles] = Encode(nothing_there);
  if (certified) harmful[channels.certified] = Encode(Widened(*certified, now_us));
  return harmful;
}

}  // namespace forereach
