// Messages that nobody, another role, another robot or an earlier process signed.
#include <map>
#include <set>
#include <utility>

#include "bus/authentic.h"
#include "forereach/command_t.hpp"
#include "task/step_time.h"
#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"
#include "tests/keys.h"
#include "torture/hostile_messages.h"

namespace forereach {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;

using Sent = RawMessage;

// Keeps the last message of each signed channel as it came, and notes what the robot obeys that nobody may have told
// it: plans from a future that nobody certifies, withdrawals with the forged number, faults and resets.
class Ear final {
 public:
  explicit Ear(Rig& rig) {
    const BusOptions& channels = rig.config().bus;
    rig.open_bus().Subscribe(Bus::kEveryChannel, [this, speakers = channels.speakers()](const Received& r) {
      if (speakers.contains(r.channel)) heard_[r.channel].assign(r.raw.begin(), r.raw.end());
    });
    rig.Hear(channels.event, [this](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      if (event &&
          (event->kind == execution_event_t::HALTED || event->kind == execution_event_t::RESET ||
           (event->kind == execution_event_t::WITHDRAWN && event->value == static_cast<double>(kForgedSequence)) ||
           (event->kind == execution_event_t::ACCEPTED && event->plan_id > WallClockUs() + (std::int64_t{1} << 31))))
        obeyed_ += " " + std::to_string(event->kind) + ": " + GetText(event->message) + ";";
    });
  }
  Ear(const Ear&) = delete;
  Ear& operator=(const Ear&) = delete;

  [[nodiscard]] const std::map<std::string, Sent>& heard() const { return heard_; }
  /** The events since the last call: kind and text. */
  [[nodiscard]] std::string TakeObeyed() { return std::exchange(obeyed_, {}); }

 private:
  std::map<std::string, Sent> heard_;
  std::string obeyed_;
};

class Forged final : Kind {
 public:
  using Kind::Kind;

  // A stranger without keys; somebody with all keys but the one that counts; another robot's keys; this robot on
  // another bus.
  void Forgeries() {
    Rig rig(DemoTask());
    Row& row = Begin(
        "On each signed channel: unsigned, forged, replayed, signed by each other role, by another robot, for another "
        "bus");
    const BusOptions& channels = rig.config().bus;
    const Speakers speakers = channels.speakers();
    Ear ear(rig);
    Signer all(rig.keys(), channels.bus_name()), other_robot(TestKeys("another-robot"), channels.bus_name()),
        other_bus(rig.keys(), "another bus");
    std::int64_t sent = 0;
    std::set<std::string> tried;
    Tries(row, rig, [&](int) {
      rig.Listen(milliseconds(700));
      const auto before = rig.witness().status().value_or(certifier_status_t{});
      static_cast<void>(ear.TakeObeyed());
      const auto recorded = ear.heard();
      for (const auto& [channel, message] : HarmfulOf(rig, recorded)) {
        const Role speaker = speakers.at(channel);
        tried.insert(channel);
        const auto send = [&, channel = channel](const Sent& bytes) {
          rig.open_bus().Publish(channel, Bytes(bytes)), ++sent;
        };
        send(message);
        for (const Role role : kAllRoles)
          if (role != speaker) send(all.Sign(role, channel, message, WallClockUs()));
        send(other_robot.Sign(speaker, channel, message, WallClockUs()));
        send(other_bus.Sign(speaker, channel, message, WallClockUs()));
        if (!recorded.contains(channel)) continue;
        Sent altered = recorded.at(channel);
        send(altered);  // once more
        altered[altered.size() / 2] ^= 1;
        send(altered);
      }
      rig.Listen(kHeartbeat);
      const auto& now = rig.witness().status();
      const auto refuses_all = [&] {
        return now && now->refused_unsigned > before.refused_unsigned && now->refused_forged > before.refused_forged &&
               now->refused_replayed > before.refused_replayed;
      };
      Demand(row, rig.ListenUntil(refuses_all, kSaysSoon), "of unsigned, forged or replayed ones it refused none");
      DemandNothingBelieved(row, rig, before, ear.TakeObeyed());
      Demand(row, now && now->messages_refused == before.messages_refused,
             "the certifier looked into a message that nobody may send");
    });
    Demand(row, tried.size() == speakers.size(), "only " + std::to_string(tried.size()) + " channels were tried");
    Remark(row, std::to_string(sent) + " sent on " + std::to_string(tried.size()) + " channels");
    if (rig.witness().status()) {
      const auto& s = *rig.witness().status();
      Remark(row, "refused by the certifier: " + std::to_string(s.refused_unsigned) + " unsigned, " +
                      std::to_string(s.refused_forged) + " forged or of another bus, " +
                      std::to_string(s.refused_replayed) + " replayed");
    }
    StolenKeys();
  }

  // Each channel's speaker has signed them: before the processes began, or ahead of their clocks. What was heard of the
  // processes before them is sent again as it was.
  void OldMessages() {
    Rig rig(DemoTask());
    Row& row = Begin(
        "On each signed channel: signed by its speaker before the start of certifier and robot, or while a clock was "
        "ahead");
    const BusOptions& channels = rig.config().bus;
    const Speakers speakers = channels.speakers();
    Ear ear(rig);
    std::int64_t sent = 0, refused = 0;
    const std::int64_t rig_began = WallClockUs();
    Tries(row, rig, [&](int) {
      rig.Listen(milliseconds(700));
      const std::map<std::string, Sent> recorded = ear.heard();
      auto harmful = HarmfulOf(rig, recorded);
      transition_t contradiction =
          recorded.contains(channels.transition)
              ? Decoded<transition_t>(WithoutSignature(recorded.at(channels.transition))).value_or(transition_t{})
              : transition_t{};
      contradiction.next_state[0] += 1;
      contradiction.duration_us = StepUs(rig.config());  // or it would not be learned for that
      harmful[channels.transition] = Encode(contradiction);
      for (const Rig::Role role : {Rig::kCertifier, Rig::kRobot}) rig.End(role), rig.Start(role);
      rig.witness().Forget();
      const auto begun = [&] { return rig.witness().status().has_value(); };
      Demand(row, rig.ListenUntil(begun, kStarts), "the certifier did not start");
      rig.Listen(kHeartbeat);
      const auto before = rig.witness().status().value_or(certifier_status_t{});
      static_cast<void>(ear.TakeObeyed());
      const std::int64_t now = WallClockUs();
      constexpr std::int64_t kHourUs = 3'600'000'000;
      for (const auto& [channel, raw] : recorded) rig.open_bus().Publish(channel, Bytes(raw)), ++sent;
      for (const auto& [channel, message] : harmful)
        for (const std::int64_t when :
             {now - kHourUs, rig_began - 5'000'000, now + kStopsAheadUs + 30'000'000, now + kHourUs})
          rig.open_bus().Publish(
              channel,
              Bytes(Signer(rig.keys(), channels.bus_name()).Sign(speakers.at(channel), channel, message, when))),
              ++sent;
      rig.Listen(kHeartbeat);
      const auto& status = rig.witness().status();
      const auto refuses = [&] { return status && status->refused_replayed > before.refused_replayed; };
      Demand(row, rig.ListenUntil(refuses, kSaysSoon), "it refused none");
      DemandNothingBelieved(row, rig, before, ear.TakeObeyed());
      if (status) refused += status->refused_replayed - before.refused_replayed;
    });
    Remark(row, std::to_string(sent) + " sent, " + std::to_string(refused) +
                    " times the certifier refused one, on the channels that it hears");
  }

  // The machine of a role is lost, and the role gets a new key: messages of the old one count for nothing any more, and
  // those of the other roles do as before.
  void NewKeys() {
    Rig rig(DemoTask());
    Row& row = Begin("The key of a role is made anew; messages signed with the old one, and old messages again",
                     options_.others);
    auto ear = std::make_unique<Ear>(rig);
    std::int64_t sent = 0, refused = 0, counted = 0;
    Tries(row, rig, [&](int i) {
      const Role role = kAllRoles[static_cast<std::size_t>(i) % kAllRoles.size()];
      rig.Listen(milliseconds(700));
      const auto recorded = ear->heard();
      const KeyRing old_keys = rig.keys();
      rig.MakeKeyAgain(role);
      ear = std::make_unique<Ear>(rig);
      const std::string why = rig.Heal();
      Demand(row, why.empty(), "it does not go on with a new key of the " + std::string(RoleName(role)) + ": " + why);
      const auto before = rig.witness().status().value_or(certifier_status_t{});
      static_cast<void>(ear->TakeObeyed());

      const BusOptions& channels = rig.config().bus;
      const Speakers speakers = channels.speakers();
      Signer old_signer(old_keys, channels.bus_name());
      for (const auto& [channel, raw] : recorded) rig.open_bus().Publish(channel, Bytes(raw)), ++sent;
      for (const auto& [channel, message] : HarmfulOf(rig, recorded))
        if (speakers.at(channel) == role)
          rig.open_bus().Publish(channel, Bytes(old_signer.Sign(role, channel, message, WallClockUs()))), ++sent;
      rig.Listen(kHeartbeat);
      const auto& now = rig.witness().status();
      const auto refuses = [&] {
        return now && now->refused_replayed + now->refused_forged > before.refused_replayed + before.refused_forged &&
               (!IsHeardByCertifier(role) || now->refused_forged > before.refused_forged);
      };
      Demand(row, rig.ListenUntil(refuses, kSaysSoon), "it refused none");
      DemandNothingBelieved(row, rig, before, ear->TakeObeyed());
      Demand(row, now && now->messages_refused == before.messages_refused,
             "the certifier looked into a message of the old key");
      if (now) refused += now->refused_forged - before.refused_forged;
      if (role != Role::kOperator) counted += DemandReloads(row, rig, old_signer);
    });
    Remark(row, std::to_string(sent) + " sent, " + std::to_string(refused) +
                    " times the certifier refused one of the old key; " + std::to_string(counted) +
                    " commands of a role that kept its key were obeyed");
  }

 private:
  static bool IsHeardByCertifier(Role role) {
    return role == Role::kPlanner || role == Role::kRobot || role == Role::kOperator;
  }

  // An operator who knows of no new key asks for it.
  static bool DemandReloads(Row& row, Rig& rig, Signer& signer) {
    const std::string& channel = rig.config().bus.command;
    const std::int64_t before = rig.witness().status() ? rig.witness().status()->version : 0;
    const command_t command{.utime = WallClockUs(), .kind = command_t::RELOAD};
    rig.open_bus().Publish(channel, Bytes(signer.Sign(Role::kOperator, channel, Encode(command), WallClockUs())));
    const auto reloads = [&] { return rig.witness().status() && rig.witness().status()->version > before; };
    const bool obeyed = rig.ListenUntil(reloads, kSaysSoon);
    Demand(row, obeyed, "a command of a role that kept its key was not obeyed");
    return obeyed;
  }

  // Neither by the certifier nor by the robot.
  static void DemandNothingBelieved(Row& row, Rig& rig, const certifier_status_t& before, const std::string& obeyed) {
    const auto& now = rig.witness().status();
    Demand(row, !rig.witness().fault(), "a fault was believed or latched");
    Demand(row, obeyed.empty(),
           "the robot obeyed a fault, a reset, a certificate or a withdrawal that nobody made:" + obeyed);
    Demand(row, now && now->version == before.version && now->failed_reloads == before.failed_reloads,
           "a reload was obeyed");
    Demand(row, now && GetDigest(now->obstacles_digest) == GetDigest(before.obstacles_digest),
           "obstacles were believed");
  }

  static std::map<std::string, Sent> HarmfulOf(const Rig& rig, const std::map<std::string, Sent>& heard) {
    return HarmfulMessages(rig.config().bus, heard, rig.witness().last_certified(), WallClockUs());
  }

  // The adversary of the gate itself: a learned planner that has its key file, or another role's.
  void StolenKeys() {
    Rig rig(DemoTask());
    Row& row = Begin(
        "Certificates with slices of +-1e9, signed with a stolen key of planner, perception, robot, operator, logger");
    std::set<std::int64_t> forged, obeyed;
    rig.Hear(rig.config().bus.event, [&](const Received& r) {
      const auto event = Decoded<execution_event_t>(r.bytes);
      if (event && event->kind != execution_event_t::REFUSED && forged.contains(event->plan_id))
        obeyed.insert(event->plan_id);
    });
    Signer thief(rig.keys(), rig.config().bus.bus_name());
    Tries(row, rig, [&](int i) {
      const Role stolen = kAllRoles[1 + static_cast<std::size_t>(i) % (kAllRoles.size() - 1)];
      for (int j = 0; j < 20; ++j) {
        certified_plan_t certified = Widened(*rig.witness().last_certified(), WallClockUs());
        certified.plan.plan_id += j;
        certified.plan.start_utime += 40'000 * j;
        certified = Sealed(certified);
        forged.insert(certified.plan.plan_id);
        const std::string& channel = rig.config().bus.certified;
        rig.open_bus().Publish(channel, Bytes(thief.Sign(stolen, channel, Encode(certified), WallClockUs())));
        rig.Listen(milliseconds(20));
      }
      rig.Listen(milliseconds(500));
      Demand(row, obeyed.empty(), "the robot took a certificate that the certifier did not make");
    });
    Remark(row, std::to_string(forged.size()) + " forged, " + std::to_string(obeyed.size()) + " executed");
  }
};

}  // namespace

void Forgeries(Campaign& campaign) { Forged(campaign).Forgeries(); }
void Keys(Campaign& campaign) {
  Forged kind(campaign);
  kind.NewKeys();
  kind.OldMessages();
}

}  // namespace forereach
