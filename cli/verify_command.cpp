#include <iostream>
#include <map>
#include <memory>
#include <utility>

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/each_run.h"
#include "cli/shards.h"
#include "forereach/certify/certifier.h"
#include "forereach/numerics/parallel.h"
#include "lcmtypes/printable.h"
#include "records/certificate_files.h"
#include "records/kept_obstacles.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/result.h"
#include "task/json_text.h"

namespace forereach {
namespace {

using verifier::Status;
using verifier::Verdict;

struct VerifyArguments {
  std::vector<std::string> files;
  std::string config;
  LogKey key;
  bool json = false;
  unsigned jobs = AllCores();
  ShardOptions shard;
};

// What was found in one run, or in several.
struct Verified {
  std::int64_t certificates = 0, confirmed = 0, refuted = 0, cannot_verify = 0, not_certificates = 0, remainders = 0;
  bool of_decision = false;
  PassedOver passed_over;
  std::string first_failure;  // for people
  nlohmann::json failures = nlohmann::json::array();
};
FOREREACH_RESULT(Verified, certificates, confirmed, refuted, cannot_verify, not_certificates, remainders, of_decision,
                 passed_over, first_failure, failures)

// What the verifier relies on: the certifier accepts no other problem.
void RequireAcceptable(const Config& config) {
  try {
    const Certifier certifier(config.problem);
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: {}", config.path, error.what());
  }
}

std::string DescribeVerdict(const RecordedCertificate& recorded, const Verdict& verdict) {
  const bool is_refuted = verdict.status == Status::kRefuted;
  const auto both = [](const std::string& expected, const std::string& found) {
    return fmt::format("    expected {}\n    found    {}\n", expected, found);
  };
  std::string text = fmt::format("{}: {}\n", is_refuted ? "refuted" : "cannot verify", Printable(recorded.name));
  for (const Mismatch& mismatch : recorded.mismatches)
    text += fmt::format("  {}\n{}", mismatch.what, both(mismatch.expected, mismatch.found));
  const verifier::Failure& failure = verdict.failure;
  if (failure.what.empty()) return text + "  every step of its mathematics holds for the inputs given\n";
  text += fmt::format("  {}{}{}\n", failure.step >= 0 ? fmt::format("step {}: ", failure.step) : "",
                      is_refuted ? "not so: " : "", failure.what);
  if (!failure.bound.empty()) text += both(failure.bound, failure.found);
  if (failure.excess < 1e-12) text += fmt::format("    which is off by {:g} of its size\n", failure.excess);
  return text;
}

nlohmann::json ToJson(const RecordedCertificate& recorded, const Verdict& verdict) {
  const verifier::Failure& failure = verdict.failure;
  nlohmann::json document{{"certificate", recorded.name},
                          {"verdict", verdict.status == Status::kRefuted ? "refuted" : "cannot_verify"},
                          {"step", failure.step < 0 ? nlohmann::json(nullptr) : nlohmann::json(failure.step)},
                          {"claim", failure.what},
                          {"expected", failure.bound},
                          {"found", failure.found},
                          {"mismatches", nlohmann::json::array()}};
  for (const Mismatch& mismatch : recorded.mismatches)
    document["mismatches"].push_back(
        {{"what", mismatch.what}, {"expected", mismatch.expected}, {"found", mismatch.found}});
  return document;
}

// Verifies certificates on several threads. What it says does not depend on their number.
class Verifying final : public CertificateUser {
 public:
  // @param robot whose certificates they are, if there are several runs. @param shard which of them are verified.
  Verifying(unsigned threads, const std::string* robot, const Shard& shard)
      : threads_(threads), robot_(robot), shard_(shard) {}

  void OnCertificate(RecordedCertificate&& recorded, const Basis* basis) override {
    constexpr std::size_t kBatch = 256;
    verifier::Verifier* const verifier = recorded.missing.empty() ? &VerifierOf(*basis) : nullptr;
    if (!results_.Next(shard_)) return;
    waiting_.push_back({std::move(recorded), results_.cases - 1, verifier, {}});
    obstacles_.Add(waiting_.back().recorded.certificate.obstacles);
    if (waiting_.size() == kBatch || obstacles_.AreTooMany()) VerifyWaiting();
  }

  CaseResults<Verified> Finish(const BesideCertificates& beside) {
    VerifyWaiting();
    results_.of_run.not_certificates = beside.not_certificates;
    results_.of_run.passed_over = beside.passed_over;
    return std::move(results_);
  }

 private:
  struct Waiting {
    RecordedCertificate recorded;
    std::int64_t number;           // of the case
    verifier::Verifier* verifier;  // null if it cannot be derived
    Verdict verdict;
  };
  // What is verified of one problem.
  struct Known {
    std::shared_ptr<const Problem> problem;
    std::unique_ptr<verifier::Verifier> verifier;
    decltype(Basis::learned) learned;  // since the last start or reload
    bool is_waited_for = false;
  };

  verifier::Verifier& VerifierOf(const Basis& basis) {
    Known& known = known_[basis.task->problem.get()];
    if (known.learned && known.learned != basis.learned && known.learned->size() > 0) {
      VerifyWaiting();
      known.verifier.reset();  // it forgets what was learned before
    }
    if (!known.verifier) {
      RequireAcceptable(*basis.task);
      known.problem = basis.task->problem;
      known.verifier = std::make_unique<verifier::Verifier>(known.problem, verifier::MethodOf(*known.problem));
    }
    known.learned = basis.learned;
    known.is_waited_for = known.learned != nullptr;  // a document has nothing learned
    return *known.verifier;
  }

  void VerifyWaiting() {
    for (auto& [of, known] : known_)
      if (std::exchange(known.is_waited_for, false))
        known.verifier->Learn(WithLearned(known.problem->transitions, *known.learned, known.learned->size()));
    ForEachInParallel(waiting_.size(), threads_, [&](std::size_t i, std::size_t) {
      auto& [recorded, number, verifier, verdict] = waiting_[i];
      verdict = verifier ? verifier->Verify(recorded.certificate)
                         : Verdict{Status::kCannotVerify, {-1, recorded.missing, "", ""}};
      if (!recorded.mismatches.empty() && verdict.status == Status::kConfirmed) verdict.status = Status::kRefuted;
    });
    for (const Waiting& each : waiting_)
      Add(each.recorded, each.verdict,
          each.verdict.status == Status::kConfirmed ? results_.counts : results_.told[each.number]);
    waiting_.clear();
    obstacles_ = {};
  }

  void Add(const RecordedCertificate& recorded, const Verdict& verdict, Verified& to) {
    const Status status = verdict.status;
    ++to.certificates;
    ++(status == Status::kConfirmed ? to.confirmed : status == Status::kRefuted ? to.refuted : to.cannot_verify);
    to.remainders += recorded.certificate.is_remainder;
    if (status == Status::kConfirmed) return;
    to.failures.push_back(ToJson(recorded, verdict));
    if (robot_) to.failures.back()["robot"] = *robot_;
    if (!has_failed_) to.first_failure = (robot_ ? *robot_ + ": " : "") + DescribeVerdict(recorded, verdict);
    has_failed_ = true;
  }

  const unsigned threads_;
  const std::string* const robot_;
  const Shard shard_;
  std::map<const Problem*, Known> known_;
  std::vector<Waiting> waiting_;
  KeptObstacles obstacles_;  // of these
  bool has_failed_ = false;
  CaseResults<Verified> results_;
};

void PrintJson(const Verified& sum, const NamedRuns& named) {
  nlohmann::json document = sum;
  for (const char* other : {"of_decision", "remainders", "first_failure"}) document.erase(other);
  document["passed_over"] = ToJson(sum.passed_over);
  if (named.is_many) {
    document["runs"] = named.runs.size();
    document["missing"] = named.missing;
  }
  std::cout << JsonText(document) << std::endl;
}

// The meaning of "confirmed".
std::string Extent(const Verified& sum) {
  if (sum.certificates == 0) return "  checked: nothing, because there are no certificates";
  if (sum.of_decision)
    return "  checked: every field of the decision except elapsed_us and capped: digests against the task and its "
           "data; hull,\n"
           "  generators, envelope, remainder, radius and clearance of each slice against a rederived tube; the "
           "witness\n"
           "  and the sentence against the clearances";
  return "  checked: for each certified plan its digests, its candidate, the obstacles in force, the hull of each "
         "slice against\n  a rederived tube, and the clearance of this tube from every obstacle; of its decision, if "
         "the log has it, inputs,\n"
         "  witness, margin and sentence. Not checked: times, sequence numbers, elapsed_us, which step is the closest";
}

void PrintForPeople(const Verified& sum, const NamedRuns& named) {
  for (const std::string& missing : named.missing) std::cout << Printable(missing) << "\n";
  std::cout << PrintableLines(sum.first_failure);
  std::cout << "verify: " << sum.certificates << " certificates, " << sum.confirmed << " confirmed, " << sum.refuted
            << " refuted, " << sum.cannot_verify << " cannot be verified";
  if (sum.not_certificates > 0)
    std::cout << "; " << sum.not_certificates << " abstentions and rejections are not certificates";
  if (sum.remainders > 0) std::cout << "; " << sum.remainders << " of the certificates: what a withdrawal leaves";
  if (named.is_many) std::cout << "; " << named.runs.size() << " runs";
  if (!named.missing.empty()) std::cout << "; " << named.missing.size() << " logs or runs could not be read";
  std::cout << DescribePassedOver(sum.passed_over) << "\n" << Extent(sum) << std::endl;
}

// Not logs: a decision, or what ReadCertificates refuses.
bool IsDocument(const std::vector<std::string>& files) {
  if (files.size() != 1) return false;
  const FileKind kind = KindOf(files[0]);
  return kind != FileKind::kDirectory && kind != FileKind::kDatabase && kind != FileKind::kEventLog;
}

int PrintVerified(const Verified& sum, const NamedRuns& named, bool json) {
  json ? PrintJson(sum, named) : PrintForPeople(sum, named);
  return sum.confirmed == sum.certificates && sum.certificates > 0 && named.missing.empty() ? 0 : 1;
}

Verified SumOf(ResultsOfRuns<Verified> results) {
  Verified sum;
  for (auto& each : results)
    if (each) sum += std::move(*each).Sum();
  return sum;
}

int VerifyDecision(const VerifyArguments& options) {
  const std::string& file = options.files[0];
  if (options.shard.is_given()) throw ConfigError("{}: --shard divides logs, and this is a single decision", file);
  Verifying verifying(options.jobs, nullptr, {});
  Verified sum = verifying.Finish(ReadCertificates(file, options.config, options.key, verifying)).Sum();
  sum.of_decision = true;
  return PrintVerified(sum, {}, options.json);
}

int Verify(const VerifyArguments& options) {
  const Shard shard = options.shard.Get();
  if (IsDocument(options.files)) return VerifyDecision(options);
  NamedRuns named = RunsNamedBy(options.files, options.jobs);
  const RunTasks tasks(options.config, options.key, named.is_many);
  const auto verify = [&](const RunLogs& run, RunWork& work) {
    Verifying verifying(work.threads, named.is_many ? &run.robot : nullptr, shard);
    return verifying.Finish(
        ReadRun(run, tasks, named.is_many, verifying, [&](std::int64_t bytes) { work.Read(bytes); }));
  };
  auto results = ForEachRun<CaseResults<Verified>>(named, options.jobs, "verified", verify);
  if (options.shard.is_given())
    return WriteShard(options.shard, {"verify", "", options.config, options.key}, named, results);
  return PrintVerified(SumOf(std::move(results)), named, options.json);
}

}  // namespace

int PrintMergedVerification(const Shards& shards, bool json) {
  return PrintVerified(SumOf(shards.Results<Verified>()), shards.named(), json);
}

Command VerifyCommand() {
  const auto options = std::make_shared<VerifyArguments>();
  Command command{
      .name = "verify",
      .footer =
          "Each certificate is compared with the digests of its inputs, then with a tube rederived from them: every\n"
          "recorded set has to contain the derived one, and the derived tube has to stay clear of every obstacle.\n"
          "Abstentions claim nothing and are not verified.\n\n"
          "Examples:\n"
          "  forereach certify --json --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv > "
          "decision.json\n"
          "  forereach verify decision.json\n"
          "  forereach verify run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach verify run/log\n"
          "  forereach verify run/log --shard 2/7 --out part2.json",
      .options = {Required({"files", &options->files, "DECISION|LOG|DATABASE|DIRECTORY",
                            fmt::format("The certificates: a decision (the output of certify --json), or {}", kRuns)}),
                  {"--config", &options->config, "FILE", kTaskOfRecords},
                  JsonFlag(options->json)},
      .run = [options] { return Verify(*options); }};
  command.options.push_back(JobsOption(options->jobs));
  options->shard.AddTo(command.options);
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
