#include "records/certificate_files.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include <nlohmann/json.hpp>

#include "certifier/certify/explain.h"
#include "certifier/gate/obstacles_in_force.h"
#include "certifier/gate/transition_message.h"
#include "certifier/numerics/text.h"
#include "certifier/task/files.h"
#include "certifier/task/json_file.h"
#include "certifier/task/key.h"
#include "forereach/candidate_plan_t.hpp"
#include "forereach/certified_plan_t.hpp"
#include "forereach/decision_t.hpp"
#include "lcmtypes/names.h"
#include "lcmtypes/seal.h"
#include "records/database.h"
#include "records/event_log.h"
#include "records/log_authenticator.h"
#include "records/log_directory.h"
#include "records/log_survey.h"
#include "records/log_tasks.h"
#include "records/restarts.h"

namespace forereach {
namespace {

using Json = nlohmann::json;

void Compare(RecordedCertificate& certificate, const std::string& what, const std::string& expected,
             const std::string& found) {
  if (expected != found) certificate.mismatches.push_back({what, expected, found});
}

constexpr const char* kOtherInput = "another input than the certificate was made of: digest of the ";

std::string Altered(const std::string& what) { return "the record was altered after it was made: " + what; }

// ---- A decision's document.

CertificateFile FromDecision(const std::string& path, const Json& document, const std::string& config_path) {
  const std::string task = TaskOf(path, document);
  CertificateFile file;
  file.of_decision = true;
  file.config = LoadConfig(config_path.empty() ? task : config_path);
  if (!IsCertificate(path, document)) {
    file.not_certificates = 1;
    return file;
  }
  DecisionRecord record = ReadCertificate(path, document, file.config);
  file.certificates.push_back({path, std::move(record.mismatches), "", std::move(record.certificate)});
  return file;
}

// ---- An event log.

// The obstacles that were in force, one version after the other, in the order of the log.
class ObstacleHistory {
 public:
  explicit ObstacleHistory(const Config& config) : config_(config), versions_{ObstaclesInForce(config)} {}

  void Restart() { versions_.emplace_back(config_); }

  void Reload() {
    ObstaclesInForce after(config_);
    after.Inherit(versions_.back());
    versions_.push_back(std::move(after));
  }

  // As the gate takes them.
  void Update(const LogEvent& event) {
    ObstaclesInForce after = versions_.back();
    if (!after.Update(event.message(), event.utime).empty()) return;
    if (after.digest() == versions_.back().digest())  // the whole set is sent again and again
      versions_.back() = std::move(after);
    else
      versions_.push_back(std::move(after));
  }

  [[nodiscard]] std::size_t now() const { return versions_.size() - 1; }

  // The version of that digest that was in force some time since `first`; without one, that which was at `first`.
  [[nodiscard]] std::size_t Find(std::size_t first, const Digest& digest) const {
    for (std::size_t i = first; i < versions_.size(); ++i)
      if (versions_[i].digest() == digest) return i;
    return first;
  }

  [[nodiscard]] const ObstaclesInForce& version(std::size_t i) const { return versions_[i]; }

 private:
  const Config& config_;
  std::vector<ObstaclesInForce> versions_;
};

// The transitions that were learned on the way, and what the certifier knew at each digest of its observations.
class LearnedHistory {
 public:
  explicit LearnedHistory(const Config& config) : config_(config), digest_(config.observations_digest) { Note(); }

  // The certifier knows the file's transitions only, again.
  void Restart() {
    begin_ = rows_.size();
    digest_ = config_.observations_digest;
    Note();
  }

  // As the gate takes them.
  void Learn(const LogEvent& event) {
    const auto message = Decoded<transition_t>(event.message());
    if (!config_.gate.learns || !message) return;
    ExecutedTransition transition = FromMessage(*message, *config_.problem);
    if (!transition.refusal.empty()) return;
    rows_.push_back(std::move(transition));
    digest_ = ChainedDigest(digest_, event.message());
    Note();
  }

  // @param digest in hexadecimal.
  [[nodiscard]] std::optional<verifier::KnownRows> Find(const std::string& digest) const {
    const auto known = known_.find(digest);
    return known == known_.end() ? std::nullopt : std::optional(known->second);
  }

  // The task's problem with all of them behind its own transitions.
  [[nodiscard]] std::shared_ptr<const Problem> WithAll() const {
    auto problem = std::make_shared<Problem>(*config_.problem);
    Transitions& all = problem->transitions;
    const int base = all.size();
    all.z.conservativeResize(base + std::ssize(rows_), Eigen::NoChange);
    all.x_next.conservativeResize(base + std::ssize(rows_), Eigen::NoChange);
    for (Eigen::Index i = 0; i < std::ssize(rows_); ++i) {
      const ExecutedTransition& row = rows_[static_cast<std::size_t>(i)];
      all.z.row(base + i) = Eigen::Map<const Eigen::RowVectorXd>(row.z.data(), std::ssize(row.z));
      all.x_next.row(base + i) = Eigen::Map<const Eigen::RowVectorXd>(row.next.data(), std::ssize(row.next));
    }
    return problem;
  }

 private:
  void Note() {
    const int base = config_.problem->transitions.size();
    known_[ToHex(digest_)] = {base, base + static_cast<int>(begin_), base + static_cast<int>(rows_.size())};
  }

  const Config& config_;
  std::vector<ExecutedTransition> rows_;
  std::size_t begin_ = 0;  // of those learned since the certifier began
  Digest digest_;
  std::map<std::string, verifier::KnownRows> known_;
};

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

// Which decisions are judged under a task: those of its config digest, and under the first task those of digests
// without one.
struct Share {
  const Digest& digest;
  const std::set<Digest>& all;
  bool is_first;

  [[nodiscard]] bool Has(const Digest& other) const { return other == digest || (is_first && !all.contains(other)); }
};

class LogReading {
 public:
  // Adds what it finds to `file`; names the file of each certificate if `names` says so.
  LogReading(const std::vector<std::string>& logs, bool names, const Share& share, LearnedHistory& learned,
             CertificateFile& file)
      : config_(file.config),
        share_(share),
        authenticator_(config_.bus, PublicKeysOf(config_.bus)),
        obstacles_(config_),
        learned_(learned),
        certificates_(file.certificates),
        passed_over_(file.passed_over) {
    const LogDamage damage = ForEachEvent(logs, [&](const LogEvent& event, const std::string& log) {
      log_ = names ? std::filesystem::path(log).filename().string() + " " : "";
      Take(event);
    });
    if (damage.places > 0 && share.is_first)
      certificates_.push_back({logs[0], {}, "the log is damaged in " + std::to_string(damage.places) + " places", {}});
    for (const decision_t& decision : decisions_)
      for (auto [plan, end] = of_plan_.equal_range(GetDigest(decision.plan_digest)); plan != end; ++plan)
        CheckDecision(decision, plan->second);
    for (const auto& [digest, outcome] : outcomes_)
      if (outcome == decision_t::CERTIFIED && plans_.count(digest) == 0)
        certificates_.push_back(
            {"plan with digest " + ToHex(digest), {}, "decided as certified, but the log has no certified plan", {}});
    file.not_certificates += static_cast<std::size_t>(
        std::ranges::count_if(outcomes_, [](const auto& o) { return o.second != decision_t::CERTIFIED; }));
    if (share.is_first) passed_over_.not_authentic += authenticator_.refusals();
  }

  [[nodiscard]] const std::map<Digest, std::int16_t>& outcomes() const { return outcomes_; }
  [[nodiscard]] const std::set<Digest>& plans() const { return plans_; }

 private:
  void Take(const LogEvent& event) {
    if (!authenticator_.IsAuthentic(event)) return;
    if (event.channel == config_.bus.obstacles) {
      obstacles_.Update(event);
    } else if (event.channel == config_.bus.transition) {
      learned_.Learn(event);
    } else if (event.channel == config_.bus.status) {
      TakeStatus(event);
    } else if (event.channel == config_.bus.candidate) {
      in_force_.insert_or_assign(DigestOf(event.message()), obstacles_.now());
    } else if (event.channel == config_.bus.decision) {
      TakeDecision(event);
    } else if (event.channel == config_.bus.certified) {
      TakeCertified(event);
    }
  }

  // A certifier that was started again has the task's obstacles again.
  void NoticeRestart(std::int64_t sequence, std::int64_t& last) {
    if (sequence < last) obstacles_.Restart();
    last = sequence;
  }

  void TakeStatus(const LogEvent& event) {
    const Restarts::Kind kind = restarts_.Notice(event.message());
    if (kind == Restarts::Kind::kNone) return;
    learned_.Restart();
    if (kind == Restarts::Kind::kReload) obstacles_.Reload();
  }

  void TakeDecision(const LogEvent& event) {
    const auto decision = Decoded<decision_t>(event.message());
    if (!decision) return;
    NoticeRestart(decision->sequence, last_decision_);
    if (!share_.Has(GetDigest(decision->config_digest))) return;
    // A candidate that comes twice is rejected the second time: the certificate is the first's.
    if (decision->outcome == decision_t::CERTIFIED) decisions_.push_back(*decision);
    std::int16_t& outcome = outcomes_[GetDigest(decision->plan_digest)];
    if (outcome != decision_t::CERTIFIED) outcome = decision->outcome;
  }

  void TakeCertified(const LogEvent& event) {
    const auto certified = Decoded<certified_plan_t>(event.message());
    if (!certified) {
      passed_over_.undecodable += share_.is_first;
      return;
    }
    if (!share_.Has(GetDigest(certified->config_digest))) {
      NoticeRestart(certified->sequence, last_certified_);
      return;
    }
    RecordedCertificate certificate;
    certificate.name = log_ + "event " + std::to_string(event.number);
    if (!HasSizes(certified->plan)) {
      certificate.missing = "not of this task's sizes";
      certificates_.push_back(std::move(certificate));
      return;
    }
    NoticeRestart(certified->sequence, last_certified_);
    certificate.name += ", plan " + std::to_string(certified->plan.plan_id) + " of " + GetText(certified->plan.source);
    CheckDigests(*certified, certificate);
    of_plan_.insert({DigestOf(Encode(certified->plan)), {certificates_.size(), *certified}});
    certificates_.push_back(std::move(certificate));
  }

  [[nodiscard]] bool HasSizes(const candidate_plan_t& plan) const {
    const NominalModel& model = *config_.problem->model;
    return plan.num_states == model.num_states() && plan.num_inputs == model.num_inputs() && 1 <= plan.num_steps &&
           plan.num_steps <= kMaxSteps;
  }

  void CheckDigests(const certified_plan_t& certified, RecordedCertificate& certificate) {
    const Digest plan = DigestOf(Encode(certified.plan));
    plans_.insert(plan);
    const auto sent = in_force_.find(plan);
    const Digest named = GetDigest(certified.obstacles_digest);
    const auto& version = obstacles_.version(obstacles_.Find(sent == in_force_.end() ? 0 : sent->second, named));
    certificate.certificate = CertificateOf(certified, version.all());
    const auto compare = [&](const char* what, const char* name, const Digest& expected, const Digest& found) {
      Compare(certificate, std::string(what) + name, ToHex(expected), ToHex(found));
    };
    for (const SealFault& fault : FindSealFaults(certified))
      certificate.mismatches.push_back({Altered(fault.field), fault.expected, fault.found});
    compare(kOtherInput, "config", config_.digest, GetDigest(certified.config_digest));
    compare(kOtherInput, "model", config_.model_digest, GetDigest(certified.model_digest));
    compare(kOtherInput, "declaration", config_.declaration_digest, GetDigest(certified.declaration_digest));
    if (const auto known = learned_.Find(ToHex(GetDigest(certified.observations_digest))))
      certificate.certificate.known = *known;
    else
      compare(kOtherInput, "observations", config_.observations_digest, GetDigest(certified.observations_digest));
    compare(kOtherInput, "obstacles in force", version.digest(), named);
    if (sent == in_force_.end())
      certificate.mismatches.push_back({"its candidate is in the log", "a candidate", "none"});
  }

  struct Plan {
    std::size_t certificate;  // its place
    certified_plan_t certified;
  };

  // The decision that goes with a certified plan: it names the same inputs, and its numbers and its sentence follow
  // from a clearance that the verifier then derives for every slice.
  void CheckDecision(const decision_t& decision, const Plan& plan) {
    RecordedCertificate& certificate = certificates_[plan.certificate];
    const auto compare = [&](const std::string& field, const std::string& expected, const std::string& found) {
      Compare(certificate, Altered("its decision's " + field), expected, found);
    };
    const auto compare_digest = [&](const char* field, const auto& expected, const auto& found) {
      compare(field, ToHex(GetDigest(expected)), ToHex(GetDigest(found)));
    };
    const certified_plan_t& certified = plan.certified;
    compare_digest("config_digest", certified.config_digest, decision.config_digest);
    compare_digest("model_digest", certified.model_digest, decision.model_digest);
    compare_digest("declaration_digest", certified.declaration_digest, decision.declaration_digest);
    compare_digest("observations_digest", certified.observations_digest, decision.observations_digest);
    compare_digest("obstacles_digest", certified.obstacles_digest, decision.obstacles_digest);
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
    const int count = static_cast<int>(derived.obstacles.size());
    if (count == 0 ? decision.obstacle != -1 : decision.obstacle < 0 || decision.obstacle >= count)
      return compare("obstacle", count == 0 ? "-1" : "0 to " + std::to_string(count - 1),
                     std::to_string(decision.obstacle));
    double clearance = kInfinity;
    if (count > 0) {
      const double radius = derived.obstacles[static_cast<std::size_t>(decision.obstacle)].radius();
      compare("threshold", ToText(radius), ToText(decision.threshold));
      clearance = SubDown(decision.margin, radius);
      if (!(clearance > 0 && clearance < kInfinity))
        compare("margin", "above " + ToText(radius), ToText(decision.margin));
    } else {
      compare("margin", ToText(kInfinity), ToText(decision.margin));
      compare("threshold", "0", ToText(decision.threshold));
    }
    // The closest slice of all is no closer than that.
    for (verifier::RecordedSlice& slice : derived.slices)
      slice.clearance.assign(static_cast<std::size_t>(count), clearance);
    CompareMessage(decision, static_cast<int>(certified.plan.num_steps), clearance, certificate);
  }

  // Only the message of a log says which slice is the closest. Older records have the clearance rounded to nearest.
  static void CompareMessage(const decision_t& decision, int steps, double clearance,
                             RecordedCertificate& certificate) {
    const std::string found = GetText(decision.message);
    char nearest[32];
    std::snprintf(nearest, sizeof nearest, "%.6g", clearance);
    const auto is = [&](const std::string& sentence) { return found == sentence || found == sentence + kCapped; };
    for (int t = 0; t <= steps; ++t) {
      std::string sentence = ExplainCertificate(t, decision.obstacle, clearance);
      if (is(sentence)) return;
      const std::string down = " " + RoundedDown(clearance) + " m ";
      const std::size_t at = sentence.find(down);
      if (at != std::string::npos && is(sentence.replace(at, down.size(), " " + std::string(nearest) + " m "))) return;
    }
    Compare(certificate, Altered("its decision's message"),
            ExplainCertificate(0, decision.obstacle, clearance) + (decision.obstacle < 0 ? "" : ", or another step"),
            found);
  }

  const Config& config_;
  const Share share_;
  LogAuthenticator authenticator_;
  ObstacleHistory obstacles_;
  LearnedHistory& learned_;
  Restarts restarts_;
  std::vector<RecordedCertificate>& certificates_;
  PassedOver& passed_over_;
  std::string log_;
  std::map<Digest, std::size_t> in_force_;  // when a candidate was sent
  std::map<Digest, std::int16_t> outcomes_;
  std::set<Digest> plans_;
  std::vector<decision_t> decisions_;  // those that say CERTIFIED
  std::multimap<Digest, Plan> of_plan_;
  std::int64_t last_decision_ = -1, last_certified_ = -1;
};

std::set<Digest> DigestsOf(const std::vector<Config>& tasks) {
  std::set<Digest> digests;
  for (const Config& task : tasks) digests.insert(task.digest);
  return digests;
}

std::vector<CertificateFile> FromLogs(const std::vector<std::string>& logs, std::vector<Config> tasks) {
  const std::set<Digest> digests = DigestsOf(tasks);
  std::vector<CertificateFile> files;
  for (Config& task : tasks) {
    CertificateFile& file = files.emplace_back();
    file.config = std::move(task);
    LearnedHistory learned(file.config);
    const LogReading reading(logs, logs.size() > 1, {file.config.digest, digests, files.size() == 1}, learned, file);
    file.config.problem = learned.WithAll();
  }
  return files;
}

// ---- A decision database: its logs lie beside it, and its rows have to say what they say.

void CheckRows(const std::vector<DecisionRow>& rows, const LogReading& log, const Share& share,
               const std::set<std::string>& tasks, const LearnedHistory& learned, const Config& config,
               std::vector<RecordedCertificate>& certificates) {
  std::set<std::string> certified;
  for (const auto& [digest, outcome] : log.outcomes())
    if (outcome == decision_t::CERTIFIED) certified.insert(ToHex(digest));
  for (const DecisionRow& row : rows) {
    if (row.outcome != OutcomeName(decision_t::CERTIFIED)) continue;
    if (row.config_digest != ToHex(share.digest) && (!share.is_first || tasks.contains(row.config_digest))) continue;
    RecordedCertificate certificate;
    certificate.name = row.event.log_file + " event " + std::to_string(row.event.event_number) + " in the database";
    if (certified.erase(row.plan_digest) == 0) certificate.missing = "the log has no such certificate";
    Compare(certificate, std::string(kOtherInput) + "config", ToHex(config.digest), row.config_digest);
    Compare(certificate, std::string(kOtherInput) + "model", ToHex(config.model_digest), row.model_digest);
    Compare(certificate, std::string(kOtherInput) + "declaration", ToHex(config.declaration_digest),
            row.declaration_digest);
    if (!learned.Find(row.observations_digest))
      Compare(certificate, std::string(kOtherInput) + "observations", ToHex(config.observations_digest),
              row.observations_digest);
    if (!certificate.missing.empty() || !certificate.mismatches.empty()) {
      if (certificate.missing.empty()) certificate.missing = "the row disagrees with the log";
      certificates.push_back(std::move(certificate));
    }
  }
  for (const std::string& digest : certified)
    certificates.push_back({"plan with digest " + digest, {}, "certified in the log, but not in the database", {}});
}

// Of the files of one run; what is amiss in one of them is for the reading to say.
LogSurvey SurveyChain(const std::vector<std::string>& logs) {
  LogSurvey all;
  for (const std::string& log : logs) {
    LogSurvey one = Survey({log});
    for (const Digest& digest : one.order) {
      if (!all.configs.contains(digest)) all.order.push_back(digest);
      all.configs[digest].decisions += one.configs[digest].decisions;
      all.configs[digest].observations.merge(one.configs[digest].observations);
    }
  }
  return all;
}

// The files of each run: what a file does not know, the one before does.
std::vector<std::vector<RunRow>> Chains(Database& database) {
  std::vector<std::vector<RunRow>> chains;
  for (RunRow& run : database.Runs()) {
    if (run.continues.empty() || chains.empty() || chains.back().back().log_file != run.continues)
      chains.emplace_back();
    chains.back().push_back(std::move(run));
  }
  return chains;
}

// What is read under one task, whichever run it is of.
struct Group {
  CertificateFile file;
  std::unique_ptr<LearnedHistory> learned;
};

std::vector<CertificateFile> FromDatabase(const std::string& path, const std::string& config_path, const LogKey& key) {
  const std::string directory = std::filesystem::path(path).parent_path().string();
  std::optional<Digest> given;
  if (!config_path.empty()) given = LoadConfig(config_path).digest;
  std::vector<std::unique_ptr<Group>> groups;
  std::vector<RecordedCertificate> without_task;
  std::string why_none = path + ": no run in it has a log with decisions";
  const auto group_of = [&](const Config& task) -> Group& {
    for (const auto& group : groups)
      if (group->file.config.digest == task.digest &&
          group->file.config.observations_digest == task.observations_digest)
        return *group;
    Group& group = *groups.emplace_back(std::make_unique<Group>());
    group.file.config = task;
    group.learned = std::make_unique<LearnedHistory>(group.file.config);
    return group;
  };
  Database database(path);
  for (const std::vector<RunRow>& chain : Chains(database)) {
    std::vector<std::string> logs;
    std::vector<DecisionRow> rows;
    for (const RunRow& run : chain) {
      const std::string log = (std::filesystem::path(path).parent_path() / run.log_file).string();
      if (std::filesystem::exists(log)) {
        logs.push_back(log);
        std::ranges::move(database.Read(run.log_file).decisions, std::back_inserter(rows));
      } else {
        const char* why =
            run.log_deleted_utime ? "the log was deleted for the quota" : "the log is not in the database's directory";
        without_task.push_back({run.log_file, {}, why, {}});
        why_none = path + ": " + run.log_file + ": " + why;
      }
    }
    const LogSurvey survey = SurveyChain(logs);
    if (survey.order.empty() && rows.empty()) continue;
    std::vector<Config> tasks;
    try {
      tasks = TasksOf(survey, logs.front(), directory, given && survey.configs.contains(*given) ? config_path : "");
      key.Override(tasks, config_path);
    } catch (const ConfigError& error) {
      without_task.push_back({logs.front(), {}, why_none = error.what(), {}});
      continue;
    }
    const std::set<Digest> digests = DigestsOf(tasks);
    std::set<std::string> digests_in_hex;
    for (const Digest& digest : digests) digests_in_hex.insert(ToHex(digest));
    for (const Config& task : tasks) {
      Group& group = group_of(task);
      const Share share{task.digest, digests, &task == &tasks.front()};
      const LogReading reading(logs, true, share, *group.learned, group.file);
      CheckRows(rows, reading, share, digests_in_hex, *group.learned, group.file.config, group.file.certificates);
    }
  }
  if (groups.empty()) throw ConfigError(why_none);
  std::vector<CertificateFile> files;
  for (const auto& group : groups) {
    group->file.config.problem = group->learned->WithAll();
    files.push_back(std::move(group->file));
  }
  std::ranges::move(without_task, std::back_inserter(files.front().certificates));
  return files;
}

// ---- Which of the three.

std::vector<Config> TasksFor(const std::vector<std::string>& logs, const std::string& config_path, const LogKey& key) {
  std::vector<Config> tasks = TasksOf(logs, config_path);
  key.Override(tasks, config_path);
  return tasks;
}

}  // namespace

std::vector<CertificateFile> ReadAllCertificates(const std::string& given, const std::string& config_path,
                                                 const LogKey& key) {
  std::string path = given;
  if (KindOf(path) == FileKind::kDirectory) {
    path = (std::filesystem::path(path) / LogDirectory::kDatabase).string();
    if (!std::filesystem::is_regular_file(path)) throw ConfigError(given + ": no decision database in this directory");
  }
  try {
    switch (KindOf(path)) {
      case FileKind::kDatabase: return FromDatabase(path, config_path, key);
      case FileKind::kJson:
        return {FromDecision(path, ParseJson<Json>(ReadWhole(path, kLargestJsonFile)), config_path)};
      case FileKind::kOther:
        if (Survey({path}).events == 0) break;
        [[fallthrough]];
      default: return FromLogs({path}, TasksFor({path}, config_path, key));
    }
  } catch (const Json::exception& error) {
    throw ConfigError(path + ": not a decision of `forereach certify --json`: " + error.what());
  } catch (const std::invalid_argument& error) {
    throw ConfigError(path + ": " + error.what());
  }
  throw ConfigError(path + ": neither a decision (JSON), nor an event log, nor a decision database");
}

std::vector<CertificateFile> ReadAllLogs(const std::vector<std::string>& logs, const std::string& config_path,
                                         const LogKey& key) {
  return FromLogs(logs, TasksFor(logs, config_path, key));
}

CertificateFile ReadCertificates(const std::string& path, const std::string& config_path, const LogKey& key) {
  return std::move(ReadAllCertificates(path, config_path, key).front());
}

CertificateFile ReadLogs(const std::vector<std::string>& logs, const std::string& config_path, const LogKey& key) {
  return std::move(ReadAllLogs(logs, config_path, key).front());
}

}  // namespace forereach
