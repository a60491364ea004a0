// The live page's watcher under every message in any order, from anyone. Each news is one line of JSON; no decision is
// lost or counted twice, and a reader who keeps up has read each once; what is drawn is a tube of finite places.
#include <string>

#include <nlohmann/json.hpp>

#include "bus/log.h"
#include "certifier/gate/gate.h"
#include "forereach/certifier_status_t.hpp"
#include "forereach/fault_t.hpp"
#include "forereach/logger_status_t.hpp"
#include "forereach/withdrawal_t.hpp"
#include "fuzz/candidates.h"
#include "fuzz/small_bus.h"
#include "live/watcher.h"

namespace forereach {
namespace {

class Session final {
 public:
  explicit Session(const Config& task) : gate_(task), watcher_(task, {}, [&task] { return task; }) {}

  void Step(FuzzedDataProvider& input) {
    ++step_;
    switch (input.ConsumeIntegralInRange(0, 9)) {
      case 0: return Tick();
      case 1: return Take("ROBOT_STATE", Damaged(input, RobotState(input, step_, now_)));
      case 2: return Decide(input);
      case 3: return Take("TRANSITION", Damaged(input, Transition(input, now_)));
      case 4: return TakeObstacles(Damaged(input, AnyObstacles(input, step_, now_)));
      case 5: now_ += input.ConsumeIntegralInRange(-400'000, 1'500'000); return;
      case 6: return TakeObstacles(Damaged(input, AnyMoving(input, step_, now_)));
      case 7: return Take("EXECUTION_EVENT", Damaged(input, AnAnswer(input)));
      case 8: return TakeOther(input);
      case 9: return Take(input.PickValueInArray(kChannels), AnyBytes(input, 64));
    }
  }

  void Finish() {
    Tick();
    Require(read_ + not_shown_ == decisions_);
    Watcher::Cursor late;
    static_cast<void>(nlohmann::json::parse(watcher_.Since(late)));
  }

  [[nodiscard]] bool has_drawn() const { return has_drawn_; }

 private:
  static constexpr const char* kChannels[] = {
      "PLAN_CANDIDATE", "PLAN_CERTIFIED", "PLAN_DECISION",    "PLAN_WITHDRAWN",  "ROBOT_STATE",   "OBSTACLES",
      "TRANSITION",     "FAULT",          "CERTIFIER_STATUS", "EXECUTION_EVENT", "LOGGER_STATUS", "PLAN_ADVICE",
      "COMMAND",        "OTHER"};

  void Take(const char* channel, std::vector<std::uint8_t> bytes) {
    if (channel == std::string("PLAN_DECISION") && Decoded<decision_t>(bytes)) ++decisions_;
    ++messages_;
    watcher_.Take({messages_, now_, channel, std::move(bytes)});
  }

  void TakeObstacles(std::vector<std::uint8_t> bytes) {
    static_cast<void>(gate_.UpdateObstacles(bytes, now_));
    Take("OBSTACLES", std::move(bytes));
  }

  // The answer may be damaged on its way, too.
  void Decide(FuzzedDataProvider& input) {
    const auto candidate = Damaged(input, AnyCandidate(input, now_));
    const GateAnswer answer = gate_.Decide(candidate, now_);
    if (input.ConsumeIntegralInRange(0, 7) != 7) Take("PLAN_CANDIDATE", candidate);
    if (answer.certified) Take("PLAN_CERTIFIED", Damaged(input, *answer.certified));
    Take("PLAN_DECISION", Damaged(input, answer.decision));
  }

  void TakeOther(FuzzedDataProvider& input) {
    switch (input.ConsumeIntegralInRange(0, 3)) {
      case 0: return Take("FAULT", Damaged(input, fault_t{}));
      case 1: return Take("PLAN_WITHDRAWN", Damaged(input, withdrawal_t{}));
      case 2: return Take("CERTIFIER_STATUS", Damaged(input, certifier_status_t{}));
      case 3: return Take("LOGGER_STATUS", Damaged(input, logger_status_t{}));
    }
  }

  void Tick() {
    watcher_.Tick(now_);
    const std::string text = watcher_.Since(reader_);
    Require(text.find('\n') == std::string::npos);
    const auto news = nlohmann::json::parse(text);
    const auto& counts = news.at("now").at("counts");
    Require(counts.at("decisions") == decisions_ && counts.at("messages") == messages_);
    std::int64_t by_outcome = 0;
    for (const auto& count : counts.at("by_outcome")) by_outcome += count.get<std::int64_t>();
    Require(by_outcome == decisions_);
    not_shown_ = counts.at("not_shown");
    if (news.contains("decisions"))
      for (const auto& decision : news.at("decisions")) Look(decision.at("detail"));
  }

  void Look(const nlohmann::json& detail) {
    ++read_;
    const std::string svg = detail.at("svg");
    if (svg.empty()) return;
    has_drawn_ = true;
    Require(detail.at("units") > 0 && svg.starts_with("<g ") && svg.ends_with("</g>"));
    for (const char* no_number : {"nan", "inf"}) Require(svg.find(no_number) == std::string::npos);
  }

  std::int64_t now_ = kNow, step_ = 0, messages_ = 0, decisions_ = 0, read_ = 0, not_shown_ = 0;
  bool has_drawn_ = false;
  Gate gate_;
  Watcher watcher_;
  Watcher::Cursor reader_;
};

}  // namespace

bool Try(Bytes data) {
  static const std::vector<Config> tasks = [] {
    logging::Silence();
    return std::vector<Config>{SmallTask(), SmallTaskOnTheBus()};
  }();
  FuzzedDataProvider input(data.data(), data.size());
  Session session(tasks[input.ConsumeIntegralInRange<std::size_t>(0, tasks.size() - 1)]);
  for (int step = 0; step < 64 && input.remaining_bytes() > 0; ++step) session.Step(input);
  session.Finish();
  return session.has_drawn();
}

}  // namespace forereach
