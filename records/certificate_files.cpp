#include "records/certificate_files.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "bus/bus_options.h"
#include "certifier/gate/stamp.h"
#include "certifier/gate/upheld.h"
#include "forereach/certify/explain.h"
#include "forereach/numerics/text.h"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "records/database.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/recorded_case.h"
#include "task/files.h"
#include "task/json_text.h"

namespace forereach {
namespace {

// ---- A decision's document.

CertificateFile FromDecision(const std::string& path, const nlohmann::json& document, const std::string& config_path) {
  const std::string task = TaskOf(path, document);
  CertificateFile file;
  file.of_decision = true;
  file.config = LoadConfig(config_path.empty() ? task : config_path);
  if (!IsCertificate(path, document)) {
    file.not_certificates = 1;
    return file;
  }
  file.certificates.push_back(ReadCertificate(path, document, file.config));
  return file;
}

// ---- An event log.

verifier::KnownRows KnownRowsOf(const Basis& basis) {
  const int base = basis.task->problem->transitions.size();
  return {base, base + static_cast<int>(basis.learned_begin), base + static_cast<int>(basis.learned_end)};
}

RecordedCertificate DamagedLog(const std::string& log, std::int64_t places) {
  return {log, {}, fmt::format("the log is damaged in {} places", places), {}};
}

verifier::Certificate CertificateOf(const certified_plan_t& certified, const std::vector<Obstacle>& obstacles) {
  const candidate_plan_t& plan = certified.plan;
  const int n = plan.num_states;
  verifier::Certificate certificate;
  certificate.initial_set.center = Eigen::Map<const Eigen::VectorXd>(plan.initial_center, n);
  certificate.initial_set.generators = Eigen::Map<const Eigen::VectorXd>(plan.initial_half_width, n).asDiagonal();
  certificate.controls.resize(plan.num_inputs, plan.num_steps);
  for (int t = 0; t < plan.num_steps; ++t)
    certificate.controls.col(t) = Eigen::Map<const Eigen::VectorXd>(plan.control[t], plan.num_inputs);
  certificate.obstacles = obstacles;
  for (int t = 0; t <= plan.num_steps; ++t) {
    verifier::RecordedSlice& slice = certificate.slices.emplace_back();
    slice.lower = Eigen::Map<const Eigen::VectorXd>(certified.slice_lower[t], n);
    slice.upper = Eigen::Map<const Eigen::VectorXd>(certified.slice_upper[t], n);
  }
  return certificate;
}

// Collects the certificates of a timeline, a file for each task.
class CertificateReader final : public TimelineUser {
 public:
  explicit CertificateReader(const Config& first) { static_cast<void>(FileOf(first)); }

  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& decision = recorded.decision;
    const Digest plan = GetDigest(decision.plan_digest);
    static_cast<void>(FileOf(*recorded.basis.task));
    // A candidate that comes twice is rejected the second time: the certificate is the first's.
    if (decision.outcome == decision_t::CERTIFIED) decisions_.push_back(decision);
    Outcome& outcome = outcomes_.try_emplace(plan, Outcome{decision_t::REJECTED, recorded.basis.task}).first->second;
    if (outcome.outcome != decision_t::CERTIFIED) outcome = {decision.outcome, recorded.basis.task};
  }

  void OnCertified(const RecordedPlan& recorded) override {
    const certified_plan_t& certified = recorded.certified;
    const Config& task = *recorded.basis.task;
    CertificateFile& file = FileOf(task);
    RecordedCertificate& certificate = file.certificates.emplace_back();
    certificate.name =
        fmt::format("{}, plan {} of {}", recorded.event, certified.plan.plan_id, GetText(certified.plan.source));
    certificate.missing = WhyNotJudged(certified.plan, task);
    if (!certificate.missing.empty()) return;
    certificate.certificate = CertificateOf(certified, *recorded.basis.obstacles);
    certificate.certificate.schedule = ScheduleOf(certified.plan, task.gate);
    certificate.certificate.known = KnownRowsOf(recorded.basis);
    for (const SealFault& fault : FindSealFaults(certified))
      certificate.mismatches.push_back({kAltered + fault.field, fault.expected, fault.found});
    CompareGrounds(certificate, recorded.basis.grounds, GroundsOf(certified));
    for (const auto& [field, expected, found] :
         FindDifferences(UpheldUnder(*task.problem, task.gate), UpheldBy(certified)))
      certificate.mismatches.push_back({kOtherInput + field, expected, found});
    certificate.Compare(DigestOfInput("transitions of the task"), ToHex(task.grounds.observations),
                        ToHex(GetDigest(certified.transitions_digest)));
    if (!recorded.has_candidate) certificate.Compare("its candidate is in the log", "a candidate", "none");
    of_plan_.insert(
        {DigestOf(Encode(certified.plan)), {&file, file.certificates.size() - 1, task.problem.get(), certified}});
  }

  // What a withdrawal leaves of a plan is safe from the robot's step on, under what is in force then.
  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    if (withdrawal.valid_steps <= std::max<int>(withdrawal.first_step, 0)) return;  // nothing is claimed
    CertificateFile& file = FileOf(*recorded.basis.task);
    RecordedCertificate& certificate = file.certificates.emplace_back();
    certificate.name = fmt::format("{}, withdrawal of plan {} of {}, its first {} controls", recorded.event,
                                   withdrawal.plan_id, GetText(withdrawal.source), withdrawal.valid_steps);
    certificate.certificate.is_remainder = true;
    const auto plan = std::ranges::find_if(of_plan_, [&](const auto& entry) {
      return GetDigest(entry.second.certified.certificate_digest) == GetDigest(withdrawal.certificate_digest);
    });
    if (plan == of_plan_.end() || !recorded.is_of_known_task) {
      certificate.missing = plan == of_plan_.end() ? "its certified plan is not in the log"
                                                   : "it was judged under a task that is not kept next to the log";
      return;
    }
    const certified_plan_t& certified = plan->second.certified;
    if (withdrawal.valid_steps > certified.plan.num_steps) {
      certificate.missing = fmt::format("its plan has {} controls", certified.plan.num_steps);
      return;
    }
    if (!UpheldBy(certified).Suffices(UpheldUnder(*recorded.basis.task->problem, recorded.basis.task->gate))) {
      certificate.missing = "the robot's guard does not uphold what this task's certificates rest on";
      return;
    }
    verifier::Certificate& derived = certificate.certificate;
    derived = CertificateOf(certified, *recorded.basis.obstacles);
    derived.slices.clear();  // those of the certificate; under other observations the tube is another
    derived.controls.conservativeResize(Eigen::NoChange, withdrawal.valid_steps);
    derived.schedule = ScheduleOf(certified.plan, recorded.basis.task->gate);
    derived.known = KnownRowsOf(recorded.basis);
    derived.is_remainder = true;
    derived.first_step = withdrawal.first_step;
    CompareGrounds(certificate, recorded.basis.grounds, GroundsOf(withdrawal));
  }

  // Holds decisions and certified plans of the logs read since the last call against each other.
  // @param rows of a database, or null.
  void EndRun(const Config& first_task, const std::vector<DecisionRow>* rows) {
    for (const decision_t& decision : decisions_)
      for (auto [plan, end] = of_plan_.equal_range(GetDigest(decision.plan_digest)); plan != end; ++plan)
        CheckDecision(decision, plan->second);
    for (const auto& [digest, outcome] : outcomes_) {
      CertificateFile& file = FileOf(*outcome.task);
      if (outcome.outcome != decision_t::CERTIFIED)
        ++file.not_certificates;
      else if (!of_plan_.contains(digest))
        file.certificates.push_back(
            {"plan with digest " + ToHex(digest), {}, "decided as certified, but the log has no certified plan", {}});
    }
    if (rows) CheckRows(*rows, FileOf(first_task).certificates);
    decisions_.clear();
    outcomes_.clear();
    of_plan_.clear();
  }

  std::vector<CertificateFile> Finish(Timeline& timeline) {
    for (const auto& [task, i] : file_of_) {
      files_[i].config = *task;
      files_[i].config.problem = WithLearned(task->problem, timeline.learned(*task));
    }
    files_.front().passed_over = timeline.passed_over();
    return {std::make_move_iterator(files_.begin()), std::make_move_iterator(files_.end())};
  }

 private:
  struct Outcome {
    std::int16_t outcome;
    const Config* task;
  };
  struct Plan {
    CertificateFile* file;
    std::size_t certificate;  // its place
    const Problem* problem;
    certified_plan_t certified;
  };

  CertificateFile& FileOf(const Config& task) {
    const auto [found, is_new] = file_of_.try_emplace(&task, files_.size());
    return is_new ? files_.emplace_back() : files_[found->second];
  }

  static std::string DigestOfInput(const char* name) { return std::string(kOtherInput) + "digest of the " + name; }

  static void CompareGrounds(RecordedCertificate& certificate, const Grounds& expected, const Grounds& found) {
    for (const auto& [name, digest] : kGrounds)
      certificate.Compare(DigestOfInput(name) + (digest == &Grounds::obstacles ? " in force" : ""),
                          ToHex(expected.*digest), ToHex(found.*digest));
  }

  // The rows of a database say what the log says.
  void CheckRows(const std::vector<DecisionRow>& rows, std::vector<RecordedCertificate>& certificates) const {
    std::map<std::string, const decision_t*> certified;
    for (const decision_t& decision : decisions_) certified[ToHex(GetDigest(decision.plan_digest))] = &decision;
    for (const DecisionRow& row : rows) {
      if (row.outcome != OutcomeName(decision_t::CERTIFIED)) continue;
      RecordedCertificate certificate;
      certificate.name = fmt::format("{} event {} in the database", row.event.log_file, row.event.event_number);
      const auto decision = certified.find(row.plan_digest);
      if (decision == certified.end()) {
        certificate.missing = "the log has no such certificate";
      } else {
        const Grounds grounds = GroundsOf(*decision->second);
        for (std::size_t i = 0; i < kGrounds.size(); ++i)
          certificate.Compare(DigestOfInput(kGrounds[i].name), ToHex(grounds.*kGrounds[i].member), row.grounds[i]);
        if (!certificate.mismatches.empty()) certificate.missing = "the row disagrees with the log";
        certified.erase(decision);
      }
      if (!certificate.missing.empty()) certificates.push_back(std::move(certificate));
    }
    for (const auto& [digest, decision] : certified)
      certificates.push_back({"plan with digest " + digest, {}, "certified in the log, but not in the database", {}});
  }

  // The decision that goes with a certified plan: it names the same inputs, and its numbers and its sentence follow
  // from a clearance that the verifier then derives for every slice.
  void CheckDecision(const decision_t& decision, const Plan& plan) {
    RecordedCertificate& certificate = plan.file->certificates[plan.certificate];
    const auto compare = [&](const std::string& field, const std::string& expected, const std::string& found) {
      certificate.Compare(kAltered + ("its decision's " + field), expected, found);
    };
    const certified_plan_t& certified = plan.certified;
    const Grounds expected = GroundsOf(certified), found = GroundsOf(decision);
    for (const auto& [name, digest] : kGrounds)
      compare(std::string(name) + "_digest", ToHex(expected.*digest), ToHex(found.*digest));
    compare("plan_id", std::to_string(certified.plan.plan_id), std::to_string(decision.plan_id));
    compare("source", GetText(certified.plan.source), GetText(decision.source));
    compare("candidate_utime", std::to_string(certified.plan.utime), std::to_string(decision.candidate_utime));
    compare("cause", std::to_string(decision_t::CAUSE_NONE), std::to_string(decision.cause));
    for (const auto& [field, value] : {std::pair{"step", static_cast<int>(decision.step)},
                                       {"coordinate", decision.coordinate},
                                       {"first_observation", decision.first_observation},
                                       {"second_observation", decision.second_observation}})
      compare(field, "-1", std::to_string(value));

    verifier::Certificate& derived = certificate.certificate;
    const Problem& problem = *plan.problem;
    const int count = static_cast<int>(derived.obstacles.size());
    // An obstacle that moves need not be there during the plan.
    const bool may_be_none =
        std::ranges::all_of(derived.obstacles, [](const Obstacle& obstacle) { return obstacle.motion().has_value(); });
    if (decision.obstacle < (may_be_none ? -1 : 0) || decision.obstacle >= count)
      return compare("obstacle", count == 0 ? "-1" : fmt::format("0 to {}", count - 1),
                     std::to_string(decision.obstacle));
    double clearance = kInfinity;
    if (decision.obstacle >= 0) {
      CompareThreshold(decision, problem, static_cast<int>(certified.plan.num_steps), certificate);
      clearance = SubDown(decision.margin, decision.threshold);
      if (!(clearance > 0 && clearance < kInfinity))
        compare("margin", "above " + ToText(decision.threshold), ToText(decision.margin));
    } else {
      compare("margin", ToText(kInfinity), ToText(decision.margin));
      compare("threshold", "0", ToText(decision.threshold));
    }
    // The closest approach of all is no closer than that.
    for (std::size_t t = 0; t + (problem.between ? 1 : 0) < derived.slices.size(); ++t)
      derived.slices[t].clearance.assign(static_cast<std::size_t>(count), clearance);
    CompareMessage(decision, problem, static_cast<int>(certified.plan.num_steps), clearance, certificate);
  }

  // The threshold is the distance to be kept in some step, by some part or by the whole body.
  static void CompareThreshold(const decision_t& decision, const Problem& problem, int steps,
                               RecordedCertificate& certificate) {
    const Obstacle& obstacle = certificate.certificate.obstacles[static_cast<std::size_t>(decision.obstacle)];
    double least = kInfinity;
    for (int t = 0; t < steps + (problem.between ? 0 : 1); ++t)
      for (const double threshold : ThresholdsOf(problem, obstacle, certificate.certificate.schedule, t)) {
        if (threshold == decision.threshold) return;
        least = std::min(least, threshold);
      }
    certificate.Compare(kAltered + std::string("its decision's threshold"), ToText(least), ToText(decision.threshold));
  }

  // Only the message of a log says which step and which part is the closest.
  static void CompareMessage(const decision_t& decision, const Problem& problem, int steps, double clearance,
                             RecordedCertificate& certificate) {
    const std::string found = GetText(decision.message);
    const auto is = [&](const std::string& sentence) {
      const auto fits = [&](const std::string& text) { return found == text.substr(0, sizeof decision.message - 1); };
      return fits(sentence) || fits(sentence + kCapped);
    };
    for (int t = 0; t <= steps; ++t)
      for (int part = -1; part < static_cast<int>(problem.body.parts.size()); ++part)
        if (is(ExplainCertificate(problem, {t, decision.obstacle, part, clearance}))) return;
    certificate.Compare(kAltered + std::string("its decision's message"),
                        ExplainCertificate(problem, {0, decision.obstacle, -1, clearance}) +
                            (decision.obstacle < 0 ? "" : ", or another step"),
                        found);
  }

  std::deque<CertificateFile> files_;             // references to them stay
  std::map<const Config*, std::size_t> file_of_;  // its place
  std::map<Digest, Outcome> outcomes_;            // by plan
  std::vector<decision_t> decisions_;             // those that say CERTIFIED
  std::multimap<Digest, Plan> of_plan_;
};

// ---- Runs.

std::vector<CertificateFile> ReadLogs(const std::vector<std::string>& logs, LogTasks tasks, bool names_files,
                                      const std::vector<DecisionRow>* rows) {
  CertificateReader reader(tasks.first());
  Timeline timeline(tasks, {&reader});
  timeline.Read(logs, names_files);
  reader.EndRun(tasks.first(), rows);
  std::vector<CertificateFile> files = reader.Finish(timeline);
  if (timeline.damage().places > 0)
    files.front().certificates.push_back(DamagedLog(logs.front(), timeline.damage().places));
  return files;
}

// What cannot be read is a certificate that cannot be verified.
std::vector<CertificateFile> ReadRuns(const std::string& path, const std::string& config_path, const LogKey& key) {
  NamedRuns named = RunsNamedBy({path}, 1);
  const RunTasks tasks(config_path, key, named.is_many);
  std::vector<CertificateFile> files;
  for (const RunLogs& run : named.runs) try {
      std::ranges::move(ReadRun(run, tasks, true), std::back_inserter(files));
    } catch (const ConfigError& error) {
      named.missing.emplace_back(error.what());
    }
  if (files.empty())
    throw ConfigError(path + ": " +
                      (named.missing.empty() ? "no run in it has a log with decisions" : named.missing.back()));
  for (const std::string& missing : named.missing) files.front().certificates.push_back({missing, {}, missing, {}});
  return files;
}

}  // namespace

std::vector<CertificateFile> ReadRun(const RunLogs& run, const RunTasks& tasks, bool is_many) {
  std::vector<DecisionRow> rows;
  if (!run.database.empty()) {
    Database database(run.database);
    for (const std::string& log : run.logs)
      std::ranges::move(database.Read(std::filesystem::path(log).filename().string()).decisions,
                        std::back_inserter(rows));
  }
  if (is_many && run.logs.empty()) return {};
  LogTasks of_run = tasks.Of(run.logs);
  if (is_many && !of_run.has_decisions() && rows.empty()) return {};
  if (!is_many) of_run.RequirePlans();
  return ReadLogs(run.logs, std::move(of_run), is_many || run.logs.size() > 1, run.database.empty() ? nullptr : &rows);
}

std::vector<CertificateFile> ReadAllCertificates(const std::string& path, const std::string& config_path,
                                                 const LogKey& key) {
  try {
    switch (KindOf(path)) {
      case FileKind::kDirectory:
      case FileKind::kDatabase: return ReadRuns(path, config_path, key);
      case FileKind::kJson: return {FromDecision(path, ParseJson(ReadWhole(path, kLargestJsonFile)), config_path)};
      default: return ReadAllLogs({path}, config_path, key);
    }
  } catch (const nlohmann::json::exception& error) {
    throw ConfigError(path + ": not a decision of `forereach certify --json`: it " + DescribeJsonError(error));
  } catch (const std::invalid_argument& error) {
    throw ConfigError(path + ": " + error.what());
  }
}

std::vector<CertificateFile> ReadAllLogs(const std::vector<std::string>& logs, const std::string& config_path,
                                         const LogKey& key) {
  LogTasks tasks = RunTasks(config_path, key, false).Of(logs);
  tasks.RequirePlans();
  return ReadLogs(logs, std::move(tasks), logs.size() > 1, nullptr);
}

}  // namespace forereach
