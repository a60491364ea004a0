#include "records/certificate_files.h"

#include <algorithm>
#include <deque>
#include <filesystem>
#include <functional>
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

BesideCertificates FromDecision(const std::string& path, const nlohmann::json& document, const std::string& config_path,
                                CertificateUser& user) {
  const std::string named = TaskOf(path, document);
  const Config task = LoadConfig(config_path.empty() ? named : config_path);
  if (!IsCertificate(path, document)) return {.not_certificates = 1, .passed_over = {}};
  Basis basis;
  basis.task = &task;
  user.OnCertificate(ReadCertificate(path, document, task), &basis);
  return {};
}

// ---- An event log.

verifier::KnownRows KnownRowsOf(const Basis& basis) {
  const int base = basis.task->problem->transitions.size();
  return {base, base, base + static_cast<int>(basis.num_learned)};
}

RecordedCertificate Missing(std::string name, std::string why) { return {std::move(name), {}, std::move(why), {}}; }

verifier::Certificate CertificateOf(const candidate_plan_t& plan, const Basis& basis) {
  const int n = plan.num_states;
  verifier::Certificate certificate;
  certificate.initial_set.center = Eigen::Map<const Eigen::VectorXd>(plan.initial_center, n);
  certificate.initial_set.generators = Eigen::Map<const Eigen::VectorXd>(plan.initial_half_width, n).asDiagonal();
  certificate.controls.resize(plan.num_inputs, plan.num_steps);
  for (int t = 0; t < plan.num_steps; ++t)
    certificate.controls.col(t) = Eigen::Map<const Eigen::VectorXd>(plan.control[t], plan.num_inputs);
  certificate.obstacles = *basis.obstacles;
  certificate.stay_in = StayInOf(*basis.task);
  certificate.schedule = ScheduleOf(plan, basis.task->gate);
  certificate.known = KnownRowsOf(basis);
  return certificate;
}

// Where X_0 was cut, if its certifier has certified it in pieces: it is certified again. What comes out proves nothing.
std::vector<PieceCut> CutsOf(const candidate_plan_t& candidate, const Basis& basis, CaseCertifier& certifiers) {
  const int most = basis.task->gate.max_pieces;
  if (most < 2) return {};
  const Certifier& certifier = certifiers.At(basis);
  const Plan plan = PlanOf(candidate, ScheduleOf(candidate, basis.task->gate));
  const auto tube = std::make_unique<Tube>();
  const auto pieces = std::make_unique<Pieces>();
  try {
    const Zonotope initial_set = InitialSetOf(candidate);
    certifier.Require(plan, initial_set, *basis.obstacles);
    const Decision whole = certifier.Certify(plan, initial_set, *basis.obstacles, *tube);
    const auto goes_on = [] { return true; };
    const Decision in_pieces =
        pieces->Certify(certifier, plan, initial_set, *basis.obstacles, whole, most, goes_on, *tube);
    if (in_pieces.outcome != Outcome::kCertified) return {};
  } catch (const std::invalid_argument&) {
    return {};
  }
  return {pieces->cuts().begin(), pieces->cuts().end()};
}

// Hands on the certificates of a timeline, each when no decision on it is expected any more.
class CertificateReader final : public TimelineUser {
 public:
  // @param has_rows whether CheckRows is called with those of a database.
  CertificateReader(bool has_rows, const std::function<void(std::int64_t)>& on_bytes, CertificateUser& user)
      : has_rows_(has_rows), on_bytes_(on_bytes), user_(user) {}

  void OnEvent(const LogEvent& event) override {
    if (on_bytes_) on_bytes_(RecordBytes(event));
  }

  void OnDecision(const RecordedDecision& recorded) override {
    const decision_t& decision = recorded.decision;
    const Digest plan = GetDigest(decision.plan_digest);
    const auto [found, is_new] = decided_.try_emplace(plan);
    Decided& decided = found->second;
    if (is_new) order_.push_back(plan);
    if (decision.outcome == decision_t::CERTIFIED) {
      // A candidate that comes twice is rejected the second time: the certificate is the first's.
      if (decided.certified.size() == kMostDecisions) decided.certified.pop_front();
      decided.certified.push_back(decision);
      if (has_rows_) in_log_.insert_or_assign(ToHex(plan), GroundsOf(decision));
      for (Open& open : open_)
        if (open.plan == plan) {
          decided.has_plan = true;
          CheckDecision(decision, open);
        }
    }
    if (order_.size() > kMostDecided) Forget();
  }

  void OnCertified(const RecordedPlan& recorded) override {
    const certified_plan_t& certified = recorded.certified;
    const Config& task = *recorded.basis.task;
    Open& open = OpenOne();
    RecordedCertificate& certificate = open.recorded;
    certificate.name =
        fmt::format("{}, plan {} of {}", recorded.event, certified.plan.plan_id, GetText(certified.plan.source));
    certificate.missing = WhyNotJudged(certified.plan, task);
    if (!certificate.missing.empty()) return;
    certificate.certificate = CertificateOf(certified.plan, recorded.basis);
    kept_.Add(certificate.certificate.obstacles);
    certificate.certificate.cuts = CutsOf(certified.plan, recorded.basis, certifiers_);
    const int n = certified.plan.num_states;
    for (int t = 0; t <= certified.plan.num_steps; ++t) {
      verifier::RecordedSlice& slice = certificate.certificate.slices.emplace_back();
      slice.lower = Eigen::Map<const Eigen::VectorXd>(certified.slice_lower[t], n);
      slice.upper = Eigen::Map<const Eigen::VectorXd>(certified.slice_upper[t], n);
    }
    for (const SealFault& fault : FindSealFaults(certified))
      certificate.mismatches.push_back({kAltered + fault.field, fault.expected, fault.found});
    CompareGrounds(certificate, recorded.basis.grounds, GroundsOf(certified));
    for (const auto& [field, expected, found] :
         FindDifferences(UpheldUnder(*task.problem, task.gate), UpheldBy(certified)))
      certificate.mismatches.push_back({kOtherInput + field, expected, found});
    certificate.Compare(DigestOfInput("transitions of the task"), ToHex(task.grounds.observations),
                        ToHex(GetDigest(certified.transitions_digest)));
    if (!recorded.has_candidate) certificate.Compare("its candidate is in the log", "a candidate", "none");
    open.basis = recorded.basis;
    open.plan = PlanDigest(certified.plan);
    open.candidate = certified.plan;
    open.grounds = GroundsOf(certified);
    plans_.push_back({GetDigest(certified.certificate_digest), certified.plan, UpheldBy(certified)});
    if (plans_.size() > kPlans) plans_.pop_front();
    if (const auto found = decided_.find(*open.plan); found != decided_.end()) {
      found->second.has_plan = true;
      for (const decision_t& decision : found->second.certified) CheckDecision(decision, open);
    }
  }

  // What a withdrawal leaves of a plan is safe from the robot's step on, under what is in force then.
  void OnWithdrawn(const RecordedWithdrawal& recorded) override {
    const withdrawal_t& withdrawal = recorded.withdrawal;
    if (withdrawal.valid_steps <= std::max<int>(withdrawal.first_step, 0)) return;  // nothing is claimed
    Open& open = OpenOne();
    RecordedCertificate& certificate = open.recorded;
    certificate.name = fmt::format("{}, withdrawal of plan {} of {}, its first {} controls", recorded.event,
                                   withdrawal.plan_id, GetText(withdrawal.source), withdrawal.valid_steps);
    verifier::Certificate& derived = certificate.certificate;
    derived.is_remainder = true;
    const auto plan = std::ranges::find(plans_, GetDigest(withdrawal.certificate_digest), &Plan::certificate);
    if (plan == plans_.end() || !recorded.is_of_known_task) {
      certificate.missing = plan == plans_.end() ? "its certified plan is not in the log"
                                                 : "it was judged under a task that is not kept next to the log";
      return;
    }
    if (withdrawal.valid_steps > plan->plan.num_steps) {
      certificate.missing = fmt::format("its plan has {} controls", plan->plan.num_steps);
      return;
    }
    if (!plan->upheld.Suffices(UpheldUnder(*recorded.basis.task->problem, recorded.basis.task->gate))) {
      certificate.missing = "the robot's guard does not uphold what this task's certificates rest on";
      return;
    }
    open.basis = recorded.basis;
    derived = CertificateOf(plan->plan, recorded.basis);  // without slices: under other observations they are others
    kept_.Add(derived.obstacles);
    derived.controls.conservativeResize(Eigen::NoChange, withdrawal.valid_steps);
    derived.is_remainder = true;
    derived.first_step = withdrawal.first_step;
    CompareGrounds(certificate, recorded.basis.grounds, GroundsOf(withdrawal));
  }

  void End() {
    while (!open_.empty()) HandOn();
    while (!order_.empty()) Forget();
  }

  // The rows of a database say what the log says. Call it after End, with those of all logs.
  void CheckRows(const std::vector<DecisionRow>& rows) {
    for (const DecisionRow& row : rows) {
      if (row.outcome != OutcomeName(decision_t::CERTIFIED)) continue;
      RecordedCertificate certificate;
      certificate.name = fmt::format("{} event {} in the database", row.event.log_file, row.event.event_number);
      const auto decision = in_log_.find(row.plan_digest);
      if (decision == in_log_.end()) {
        certificate.missing = "the log has no such certificate";
      } else {
        for (std::size_t i = 0; i < kGrounds.size(); ++i)
          certificate.Compare(DigestOfInput(kGrounds[i].name), ToHex(decision->second.*kGrounds[i].member),
                              row.grounds[i]);
        if (!certificate.mismatches.empty()) certificate.missing = "the row disagrees with the log";
        in_log_.erase(decision);
      }
      if (!certificate.missing.empty()) user_.OnCertificate(std::move(certificate), nullptr);
    }
  }

  BesideCertificates Finish(const Timeline& timeline, const std::string& log) {
    for (const auto& [digest, grounds] : in_log_)
      user_.OnCertificate(
          Missing(fmt::format("plan with digest {}", digest), "certified in the log, but not in the database"),
          nullptr);
    if (const std::int64_t places = timeline.damage().places; places > 0)
      user_.OnCertificate(Missing(log, fmt::format("the log is damaged in {} places", places)), nullptr);
    beside_.passed_over = timeline.passed_over();
    return beside_;
  }

 private:
  static constexpr std::size_t kPlans = 4096;        // more than a robot can have at one time
  static constexpr std::size_t kMostDecided = 4096;  // until then a repeated candidate is known

  static constexpr std::size_t kMostDecisions = 16;  // on one plan

  // A certificate whose decisions may still come.
  struct Open {
    RecordedCertificate recorded;
    std::optional<Basis> basis;
    std::optional<Digest> plan;  // no value if decisions are not compared
    candidate_plan_t candidate;
    Grounds grounds;
  };
  // On one plan.
  struct Decided {
    std::deque<decision_t> certified;  // the last ones that say CERTIFIED
    bool has_plan = false;
  };
  struct Plan {
    Digest certificate;
    candidate_plan_t plan;
    Upheld upheld;
  };

  Open& OpenOne() {
    while (open_.size() == kPlansTogether || (kept_.AreTooMany() && open_.size() > 1)) HandOn();
    return open_.emplace_back();
  }

  void HandOn() {
    Open& first = open_.front();
    kept_.Remove(first.recorded.certificate.obstacles);
    user_.OnCertificate(std::move(first.recorded), first.basis ? &*first.basis : nullptr);
    open_.pop_front();
  }

  // The first plan of those decided on.
  void Forget() {
    const auto first = decided_.find(order_.front());
    if (first->second.certified.empty())
      ++beside_.not_certificates;
    else if (!first->second.has_plan)
      user_.OnCertificate(Missing(fmt::format("plan with digest {}", ToHex(first->first)),
                                  "decided as certified, but the log has no certified plan"),
                          nullptr);
    decided_.erase(first);
    order_.pop_front();
  }

  static std::string DigestOfInput(const char* name) { return fmt::format("{}digest of the {}", kOtherInput, name); }

  static void CompareGrounds(RecordedCertificate& certificate, const Grounds& expected, const Grounds& found) {
    for (const auto& [name, digest] : kGrounds)
      certificate.Compare(DigestOfInput(name) + (digest == &Grounds::obstacles ? " in force" : ""),
                          ToHex(expected.*digest), ToHex(found.*digest));
  }

  // The decision that goes with a certified plan: it names the same inputs, and its numbers and its sentence follow
  // from a clearance that the verifier then derives for every slice.
  static void CheckDecision(const decision_t& decision, Open& open) {
    RecordedCertificate& certificate = open.recorded;
    const auto compare = [&](const std::string& field, const std::string& expected, const std::string& found) {
      certificate.Compare(fmt::format("{}its decision's {}", kAltered, field), expected, found);
    };
    const candidate_plan_t& plan = open.candidate;
    const Grounds found = GroundsOf(decision);
    for (const auto& [name, digest] : kGrounds)
      compare(std::string(name) + "_digest", ToHex(open.grounds.*digest), ToHex(found.*digest));
    compare("plan_id", std::to_string(plan.plan_id), std::to_string(decision.plan_id));
    compare("source", GetText(plan.source), GetText(decision.source));
    compare("candidate_utime", std::to_string(plan.utime), std::to_string(decision.candidate_utime));
    compare("cause", std::to_string(decision_t::CAUSE_NONE), std::to_string(decision.cause));
    for (const auto& [field, value] : {std::pair{"step", static_cast<int>(decision.step)},
                                       {"coordinate", decision.coordinate},
                                       {"first_observation", decision.first_observation},
                                       {"second_observation", decision.second_observation}})
      compare(field, "-1", std::to_string(value));

    verifier::Certificate& derived = certificate.certificate;
    const Problem& problem = *open.basis->task->problem;
    const int count = static_cast<int>(derived.obstacles.size());
    // An obstacle that moves need not be there during the plan.
    const bool may_be_none =
        std::ranges::all_of(derived.obstacles, [](const Obstacle& obstacle) { return obstacle.motion().has_value(); });
    if (decision.obstacle < (may_be_none ? -1 : 0) || decision.obstacle >= count)
      return compare("obstacle", count == 0 ? "-1" : fmt::format("0 to {}", count - 1),
                     std::to_string(decision.obstacle));
    double clearance = kInfinity;
    if (decision.obstacle >= 0) {
      CompareThreshold(decision, problem, static_cast<int>(plan.num_steps), certificate);
      clearance = SubDown(decision.margin, decision.threshold);
      if (!(clearance > 0 && clearance < kInfinity))
        compare("margin", fmt::format("above {}", ToText(decision.threshold)), ToText(decision.margin));
    } else {
      compare("margin", ToText(kInfinity), ToText(decision.margin));
      compare("threshold", "0", ToText(decision.threshold));
    }
    // The closest approach of all is no closer than that.
    for (std::size_t t = 0; t + (problem.between ? 1 : 0) < derived.slices.size(); ++t)
      derived.slices[t].clearance.assign(static_cast<std::size_t>(count), clearance);
    CompareMessage(decision, problem, static_cast<int>(plan.num_steps), clearance, certificate);
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
    certificate.Compare(fmt::format("{}its decision's threshold", kAltered), ToText(least), ToText(decision.threshold));
  }

  // Only the message of a log says which step and which part is the closest.
  static void CompareMessage(const decision_t& decision, const Problem& problem, int steps, double clearance,
                             RecordedCertificate& certificate) {
    const std::string found = GetText(decision.message);
    const auto sentence = [&](int t, int part) {
      return ExplainCertificate(problem, {t, decision.obstacle, part, clearance}, certificate.certificate.obstacles);
    };
    const auto& cuts = certificate.certificate.cuts;
    const std::string how = cuts.empty() ? "" : CertifiedInPieces(static_cast<int>(cuts.size() + 1) / 2);
    const auto is = [&](const std::string& expected) {
      const auto fits = [&](const std::string& text) { return found == text.substr(0, sizeof decision.message - 1); };
      return fits(expected + how) || fits(expected + kCapped + how);
    };
    for (int t = 0; t <= steps; ++t)
      for (int part = -1; part < static_cast<int>(problem.body.parts.size()); ++part)
        if (is(sentence(t, part))) return;
    certificate.Compare(fmt::format("{}its decision's message", kAltered),
                        fmt::format("{}{}{}", sentence(0, -1), how, decision.obstacle < 0 ? "" : ", or another step"),
                        found);
  }

  const bool has_rows_;
  const std::function<void(std::int64_t)>& on_bytes_;
  CertificateUser& user_;
  BesideCertificates beside_;
  CaseCertifier certifiers_;
  std::deque<Open> open_;
  KeptObstacles kept_;                     // by these
  std::map<Digest, Decided> decided_;      // by plan
  std::deque<Digest> order_;               // of these plans
  std::deque<Plan> plans_;                 // the last ones
  std::map<std::string, Grounds> in_log_;  // if there are rows: of the certificates, by plan
};

}  // namespace

BesideCertificates ReadRun(const RunLogs& run, const RunTasks& tasks, bool is_many, CertificateUser& user,
                           const std::function<void(std::int64_t)>& on_bytes) {
  if (is_many && run.logs.empty()) return {};
  std::optional<Database> database;
  if (!run.database.empty()) database.emplace(run.database);
  const auto file_of = [](const std::string& log) { return std::filesystem::path(log).filename().string(); };
  LogTasks of_run = tasks.Of(run.logs);
  if (is_many && !of_run.has_decisions() && (!database || std::ranges::all_of(run.logs, [&](const std::string& log) {
        return database->Count(file_of(log)).decisions == 0;
      })))
    return {};
  if (!is_many) of_run.RequirePlans();
  CertificateReader reader(database.has_value(), on_bytes, user);
  Timeline timeline(of_run, {&reader});
  timeline.Read(run.logs, is_many || run.logs.size() > 1);
  reader.End();
  if (database)
    for (const std::string& log : run.logs)
      database->ReadInBlocks(file_of(log), [&](const Rows& rows) { reader.CheckRows(rows.decisions); });
  return reader.Finish(timeline, run.logs.front());
}

BesideCertificates ReadCertificates(const std::string& path, const std::string& config_path, const LogKey& key,
                                    CertificateUser& user) {
  try {
    if (KindOf(path) == FileKind::kJson)
      return FromDecision(path, ParseJson(ReadWhole(path, kLargestJsonFile)), config_path, user);
    return ReadRun({.robot = "", .logs = {path}, .database = "", .missing = {}}, RunTasks(config_path, key, false),
                   false, user);
  } catch (const nlohmann::json::exception& error) {
    throw ConfigError("{}: not a decision of `forereach certify --json`: it {}", path, DescribeJsonError(error));
  } catch (const std::invalid_argument& error) {
    throw ConfigError("{}: {}", path, error.what());
  }
}

}  // namespace forereach
