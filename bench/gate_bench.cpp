// The gate whole, bytes in and messages out, and what it does beside certifying: digests and codecs.
//   gate_bench [any flag of Google Benchmark]
#include <chrono>

#include <benchmark/benchmark.h>

#include "bench/candidates.h"
#include "bus/authentic.h"
#include "certifier/gate/gate.h"
#include "forereach/certify/tube.h"
#include "lcmtypes/seal.h"

namespace forereach::bench {
namespace {

using benchmark::State;

constexpr int kObservations = 400;
constexpr std::int64_t kNow = 1'700'000'000'000'000;

Task TaskFor(std::int16_t outcome) {
  return outcome == decision_t::CERTIFIED ? MakeTask(Scenario::kBicycle, kObservations)
                                          : MakeBlockedTask(Scenario::kBicycle, kObservations);
}

// Bytes to encoded answers, as the process does it. Only that is timed: each candidate needs a new plan_id.
void RunDecide(State& state, std::int16_t outcome) {
  const Task task = TaskFor(outcome);
  Gate gate(MakeConfig(task));
  candidate_plan_t candidate = MakeCandidate(task);
  std::int64_t plan_id = 0;
  for (auto _ : state) {
    Stamp(candidate, ++plan_id, kNow);
    const std::vector<std::uint8_t> bytes = Encode(candidate);
    const auto begin = std::chrono::steady_clock::now();
    const GateAnswer answer = gate.Decide(bytes, kNow);
    if (answer.certified) benchmark::DoNotOptimize(Encode(*answer.certified));
    benchmark::DoNotOptimize(Encode(answer.decision));
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - begin;
    state.SetIterationTime(elapsed.count());
    if (answer.decision.outcome != outcome) return state.SkipWithError("not the outcome the task is made for");
  }
}

// What the gate's answer contains of the certify call alone: the same task, the same candidate.
void RunCertifyAlone(State& state) {
  const Task task = TaskFor(decision_t::CERTIFIED);
  const Certifier certifier(task.problem);
  const Zonotope initial_set = task.initial_set();
  Tube tube;
  for (auto _ : state) benchmark::DoNotOptimize(certifier.Certify(task.plan(), initial_set, task.obstacles, tube));
}

void RunDecode(State& state) {
  const std::vector<std::uint8_t> bytes = Encode(MakeCandidate(TaskFor(decision_t::CERTIFIED)));
  candidate_plan_t candidate;
  for (auto _ : state) benchmark::DoNotOptimize(Decode(bytes, candidate));
}

template <class Message>
void RunEncode(State& state) {
  const Message message{};
  for (auto _ : state) benchmark::DoNotOptimize(Encode(message));
}

void RunDigest(State& state) {
  const std::vector<std::uint8_t> bytes = Encode(MakeCandidate(TaskFor(decision_t::CERTIFIED)));
  for (auto _ : state) benchmark::DoNotOptimize(PlanDigest(Bytes(bytes)));
}

void RunCertificateDigest(State& state) {
  certified_plan_t certified{};
  certified.plan = MakeCandidate(TaskFor(decision_t::CERTIFIED));
  for (auto _ : state) benchmark::DoNotOptimize(CertificateDigest(certified));
}

// What keys add, on sending and again on receiving.
const Speakers kSpeakers{{"PLAN", Role::kPlanner}};
KeyRing BenchKeys() { return MakeKeyRing("benchmark", DigestOf("benchmark")); }

template <class Message>
void RunSign(State& state) {
  Signer signer(BenchKeys(), "bus");
  const std::vector<std::uint8_t> bytes = Encode(Message{});
  for (auto _ : state) benchmark::DoNotOptimize(signer.Sign(Role::kPlanner, "PLAN", bytes, kNow));
}

// Each is taken once only, so a batch is signed beforehand.
template <class Message>
void RunCheck(State& state) {
  Signer signer(BenchKeys(), "bus");
  Authenticator authenticator(BenchKeys(), "bus", kSpeakers, 0);
  const std::vector<std::uint8_t> bytes = Encode(Message{});
  std::vector<std::vector<std::uint8_t>> batch(256);
  std::size_t next = batch.size();
  for (auto _ : state) {
    if (next == batch.size()) {
      state.PauseTiming();
      for (auto& message : batch) message = signer.Sign(Role::kPlanner, "PLAN", bytes, kNow);
      next = 0;
      state.ResumeTiming();
    }
    if (authenticator.Check("PLAN", batch[next++], kNow).first != Authenticity::kAuthentic)
      return state.SkipWithError("not authentic");
  }
}

// What a flood costs a receiver, a message: each kind is refused by what is cheapest to see of it.
enum class Flood { kForgedTag, kReplayed, kForeign };

void RunRefuse(State& state, Flood flood, std::size_t body_bytes) {
  Authenticator authenticator(BenchKeys(), "bus", kSpeakers, 0);
  std::vector<std::uint8_t> bytes = Signer(BenchKeys(), flood == Flood::kForeign ? "another bus" : "bus")
                                        .Sign(Role::kPlanner, "PLAN", std::vector<std::uint8_t>(body_bytes), kNow);
  if (flood == Flood::kForgedTag) bytes[bytes.size() - 9] ^= 1;
  if (flood == Flood::kReplayed) benchmark::DoNotOptimize(authenticator.Check("PLAN", bytes, kNow));
  for (auto _ : state)
    if (authenticator.Check("PLAN", bytes, kNow).first == Authenticity::kAuthentic)
      return state.SkipWithError("authentic");
}

// The straightforward check, to compare with: hash the whole message and verify, whatever it is.
template <class Message>
void RunFullCheck(State& state) {
  const KeyRing keys = BenchKeys();
  const std::vector<std::uint8_t> bytes = Encode(Message{});
  const Digest digest = DigestOf(Bytes(bytes));
  const Signature signature = keys.Sign(Role::kPlanner, digest);
  for (auto _ : state)
    if (!keys.IsSigned(Role::kPlanner, DigestOf(Bytes(bytes)), signature)) return state.SkipWithError("not authentic");
}

BENCHMARK_CAPTURE(RunDecide, certified, decision_t::CERTIFIED)->Name("gate/certified")->UseManualTime();
BENCHMARK_CAPTURE(RunDecide, blocked, decision_t::ABSTAIN_SAFETY)->Name("gate/abstained")->UseManualTime();
BENCHMARK(RunCertifyAlone)->Name("gate/certify_alone");
BENCHMARK(RunDecode)->Name("gate/decode_candidate");
BENCHMARK(RunDigest)->Name("gate/digest_candidate");
BENCHMARK(RunCertificateDigest)->Name("gate/certificate_digest");
BENCHMARK_TEMPLATE(RunEncode, decision_t)->Name("gate/encode_decision");
BENCHMARK_TEMPLATE(RunEncode, certified_plan_t)->Name("gate/encode_certified");
BENCHMARK_TEMPLATE(RunSign, candidate_plan_t)->Name("gate/sign_candidate");
BENCHMARK_TEMPLATE(RunCheck, candidate_plan_t)->Name("gate/check_candidate");
BENCHMARK_TEMPLATE(RunSign, certified_plan_t)->Name("gate/sign_certified");
BENCHMARK_TEMPLATE(RunCheck, certified_plan_t)->Name("gate/check_certified");
BENCHMARK_TEMPLATE(RunFullCheck, candidate_plan_t)->Name("gate/full_check_candidate");
BENCHMARK_TEMPLATE(RunFullCheck, certified_plan_t)->Name("gate/full_check_certified");
BENCHMARK_CAPTURE(RunRefuse, forged, Flood::kForgedTag, EncodedSize<candidate_plan_t>())
    ->Name("gate/check_forged_candidate");
BENCHMARK_CAPTURE(RunRefuse, replayed, Flood::kReplayed, EncodedSize<candidate_plan_t>())
    ->Name("gate/check_replayed_candidate");
BENCHMARK_CAPTURE(RunRefuse, foreign, Flood::kForeign, EncodedSize<candidate_plan_t>())
    ->Name("gate/check_foreign_candidate");
BENCHMARK_CAPTURE(RunRefuse, forged_large, Flood::kForgedTag, EncodedSize<certified_plan_t>())
    ->Name("gate/check_forged_certified");

}  // namespace
}  // namespace forereach::bench

BENCHMARK_MAIN();
