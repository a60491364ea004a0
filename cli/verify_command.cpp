#include <algorithm>
#include <iostream>
#include <iterator>
#include <sstream>
#include <thread>

#include <nlohmann/json.hpp>

#include "certifier/certify/certifier.h"
#include "certifier/numerics/parallel.h"
#include "certifier/task/json_text.h"
#include "cli/commands.h"
#include "cli/key_options.h"
#include "cli/offline.h"
#include "cli/progress.h"
#include "lcmtypes/printable.h"
#include "records/certificate_files.h"

namespace forereach {
namespace {

using verifier::Status;
using verifier::Verdict;

struct Options {
  std::vector<std::string> files;
  std::string config;
  LogKey key;
  bool json = false;
  unsigned jobs = std::max(1u, std::thread::hardware_concurrency());
};

// What the verifier relies on: the certifier accepts no other problem.
void RequireAcceptable(const Config& config) {
  try {
    const Certifier certifier(config.problem);
  } catch (const std::invalid_argument& error) {
    throw ConfigError(config.path + ": " + error.what());
  }
}

std::vector<Verdict> VerifyAll(const CertificateFile& file, unsigned jobs) {
  const verifier::Verifier verifier(file.config.problem, verifier::MethodOf(*file.config.problem));
  std::vector<Verdict> verdicts(file.certificates.size());
  Progress progress("certificates verified", verdicts.size());
  ForEachInParallel(verdicts.size(), jobs, [&](std::size_t i, std::size_t) {
    const RecordedCertificate& recorded = file.certificates[i];
    verdicts[i] = recorded.missing.empty() ? verifier.Verify(recorded.certificate)
                                           : Verdict{Status::kCannotVerify, {-1, recorded.missing, "", ""}};
    if (!recorded.mismatches.empty() && verdicts[i].status == Status::kConfirmed) verdicts[i].status = Status::kRefuted;
    progress.Advance();
  });
  return verdicts;
}

std::ptrdiff_t Count(const std::vector<Verdict>& verdicts, Status status) {
  return std::ranges::count(verdicts, status, &Verdict::status);
}

std::string DescribeVerdict(const RecordedCertificate& recorded, const Verdict& verdict) {
  std::ostringstream text;
  text << (verdict.status == Status::kRefuted ? "refuted: " : "cannot verify: ") << Printable(recorded.name) << "\n";
  for (const Mismatch& mismatch : recorded.mismatches)
    text << "  " << mismatch.what << "\n    expected " << mismatch.expected << "\n    found    " << mismatch.found
         << "\n";
  const verifier::Failure& failure = verdict.failure;
  if (failure.what.empty()) {
    text << "  every step of its mathematics holds for the inputs given\n";
    return text.str();
  }
  text << "  ";
  if (failure.step >= 0) text << "step " << failure.step << ": ";
  text << (verdict.status == Status::kRefuted ? "not so: " : "") << failure.what << "\n";
  if (!failure.bound.empty()) text << "    expected " << failure.bound << "\n    found    " << failure.found << "\n";
  if (failure.excess < 1e-12) text << "    which is off by " << failure.excess << " of its size\n";
  return text.str();
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

void PrintJson(const CertificateFile& file, const std::vector<Verdict>& verdicts) {
  nlohmann::json failures = nlohmann::json::array();
  for (std::size_t i = 0; i < verdicts.size(); ++i)
    if (verdicts[i].status != Status::kConfirmed) failures.push_back(ToJson(file.certificates[i], verdicts[i]));
  std::cout << JsonText({{"certificates", verdicts.size()},
                         {"confirmed", Count(verdicts, Status::kConfirmed)},
                         {"refuted", Count(verdicts, Status::kRefuted)},
                         {"cannot_verify", Count(verdicts, Status::kCannotVerify)},
                         {"not_certificates", file.not_certificates},
                         {"passed_over", ToJson(file.passed_over)},
                         {"failures", failures}})
            << std::endl;
}

// The meaning of "confirmed".
std::string Extent(const CertificateFile& file) {
  if (file.certificates.empty()) return "  checked: nothing, because there are no certificates";
  if (file.of_decision)
    return "  checked: every field of the decision except elapsed_us and capped: digests against the task and its "
           "data; "
           "hull,\n"
           "  generators, envelope, remainder, radius and clearance of each slice against a rederived tube; the "
           "witness\n"
           "  and the sentence against the clearances";
  return "  checked: for each certified plan its digests, its candidate, the obstacles in force, the hull of each "
         "slice "
         "against\n  a rederived tube, and the clearance of this tube from every obstacle; of its decision, if the log "
         "has it, inputs,\n"
         "  witness, margin and sentence. Not checked: times, sequence numbers, elapsed_us, which step is the closest";
}

void PrintForPeople(const CertificateFile& file, const std::vector<Verdict>& verdicts) {
  for (std::size_t i = 0; i < verdicts.size(); ++i) {
    if (verdicts[i].status == Status::kConfirmed) continue;
    std::cout << PrintableLines(DescribeVerdict(file.certificates[i], verdicts[i]));
    break;
  }
  std::cout << "verify: " << verdicts.size() << " certificates, " << Count(verdicts, Status::kConfirmed)
            << " confirmed, " << Count(verdicts, Status::kRefuted) << " refuted, "
            << Count(verdicts, Status::kCannotVerify) << " cannot be verified";
  if (file.not_certificates > 0)
    std::cout << "; " << file.not_certificates << " abstentions and rejections are not certificates";
  const auto remainders = std::ranges::count_if(
      file.certificates, [](const RecordedCertificate& recorded) { return recorded.certificate.is_remainder; });
  if (remainders > 0) std::cout << "; " << remainders << " of the certificates: what a withdrawal leaves";
  std::cout << DescribePassedOver(file.passed_over) << "\n" << Extent(file) << std::endl;
}

int Verify(const Options& options) {
  std::vector<CertificateFile> files = options.files.size() == 1
                                           ? ReadAllCertificates(options.files[0], options.config, options.key)
                                           : ReadAllLogs(options.files, options.config, options.key);
  for (const CertificateFile& each : files) RequireAcceptable(each.config);
  CertificateFile file;  // all of them
  std::vector<Verdict> verdicts;
  for (CertificateFile& each : files) {
    std::ranges::move(VerifyAll(each, options.jobs), std::back_inserter(verdicts));
    std::ranges::move(each.certificates, std::back_inserter(file.certificates));
    file.not_certificates += each.not_certificates;
    file.passed_over.not_authentic += each.passed_over.not_authentic;
    file.passed_over.undecodable += each.passed_over.undecodable;
  }
  if (options.json)
    PrintJson(file, verdicts);
  else
    PrintForPeople(file, verdicts);
  return Count(verdicts, Status::kConfirmed) == std::ssize(verdicts) && !verdicts.empty() ? 0 : 1;
}

}  // namespace

Command VerifyCommand() {
  const auto options = std::make_shared<Options>();
  Command command{
      .name = kVerify.name,
      .purpose = kVerify.purpose,
      .footer =
          "Each certificate is compared with the digests of its inputs, then with a tube rederived from them: every\n"
          "recorded set has to contain the derived one, and the derived tube has to stay clear of every obstacle.\n"
          "Abstentions claim nothing and are not verified.\n\n"
          "Examples:\n"
          "  forereach certify --json --config config/bicycle.yaml --plan config/plans/bicycle_certified.csv > "
          "decision.json\n"
          "  forereach verify decision.json\n"
          "  forereach verify run/log/events-20260101-120000-000000.lcmlog\n"
          "  forereach verify run/log",
      .options =
          {Required(
               {"files", &options->files, "DECISION|LOG|DATABASE|DIRECTORY",
                "The certificates: a decision (the output of certify --json), an LCM event log (all logs of the run, "
                "in their order), a decision database with its logs in the same directory, or the directory of both"}),
           {"--config", &options->config, "FILE", kTaskOfRecords},
           JobsOption(options->jobs),
           JsonFlag(options->json)},
      .run = [options] { return Verify(*options); }};
  AddKeyOptions(command.options, options->key);
  return command;
}

}  // namespace forereach
