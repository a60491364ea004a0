// One process is killed, stopped or told to read what is no task file: it starts again, or goes on, and forgets no
// fault.
#include <filesystem>
#include <fstream>

#include <sys/stat.h>

#include "forereach/command_t.hpp"
#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"

namespace forereach {
namespace {

class Hurt final : Kind {
 public:
  using Kind::Kind;

  void Kills() { Signals("SIGKILL at a random moment", SIGKILL, options_.kills); }

  void Stops() { Signals("SIGSTOP for up to 2 s", SIGSTOP, options_.others * 2); }

  void LatchedKills() {
    Rig rig(DemoTask());
    Row& row = Begin("SIGKILL of a certifier with a latched fault");
    std::int64_t sequence = Witness::kFirstLie;
    Tries(row, rig, [&](int) {
      const std::optional<fault_t> fault = Provoke(row, rig, sequence++);
      rig.Listen(milliseconds(Below(30)));  // perhaps before it is on the disk
      rig.End(Rig::kCertifier, SIGKILL);
      rig.Start(Rig::kCertifier);
      if (fault) DemandStillLatched(row, rig, *fault);
    });
  }

  void Reloads() {
    Rig rig(DemoTask());
    Row& row = Begin("Reload of a bad task file");
    const std::string path = rig.task_path(), good = rig.task();
    Tries(row, rig, [&](int i) {
      const certifier_status_t before = *rig.witness().status();
      const auto& now = rig.witness().status();
      std::ofstream(path) << Spoilt(good, i / 2);
      if (i % 2 == 0)
        rig.Signal(Rig::kCertifier, SIGHUP);
      else
        rig.Command(command_t::RELOAD);
      DemandRefusedAndCertifying(row, rig, before);
      rig.Listen(kHeartbeat);
      Demand(row, now->failed_reloads == before.failed_reloads + 1, "it was not refused once");
      Demand(row, GetText(now->message).starts_with("the last reload failed"), "the heartbeat does not say so");
      Demand(row, now->version == before.version, "it raised the version");
      const Digest digest = GetDigest(rig.witness().last_certified()->config_digest);
      Demand(row, digest == GetDigest(before.config_digest), "plans were certified under another task");

      std::ofstream(path) << good;
      DemandTaken(row, rig, before);
    });
    ReloadOfNoFile(rig);
  }

 private:
  void Signals(const std::string& fault, int signal, int tries) {
    Rig rig(DemoTask());
    Row& row = Begin(fault, tries);
    Tries(row, rig, [&](int i) {
      const auto role = static_cast<Rig::Role>(i % Rig::kRoles);
      rig.Listen(milliseconds(Below(120)));
      if (signal == SIGKILL) return rig.End(role, SIGKILL);
      rig.Signal(role, signal);
      rig.Listen(milliseconds(Below(2000)));
      rig.Signal(role, SIGCONT);
    });
  }

  // A reload that has been asked for is refused, and the certifier goes on. @param before its heartbeat then.
  static void DemandRefusedAndCertifying(Row& row, Rig& rig, const certifier_status_t& before) {
    const auto refused = [&] { return rig.witness().status()->failed_reloads > before.failed_reloads; };
    Demand(row, rig.ListenUntil(refused, kSaysSoon), "it was not refused");
    const std::int64_t certificates = rig.witness().certificates();
    const auto certifies = [&] { return rig.witness().certificates() > certificates; };
    Demand(row, rig.ListenUntil(certifies, kSaysSoon), "nothing was certified after it");
  }

  // The task file is good again: a reload takes it.
  static void DemandTaken(Row& row, Rig& rig, const certifier_status_t& before) {
    rig.Command(command_t::RELOAD);
    const auto taken = [&] { return rig.witness().status()->version > before.version; };
    Demand(row, rig.ListenUntil(taken, kSaysSoon), "the good file was not taken after it");
  }

  // Certainly bad, each way in turn.
  std::string Spoilt(const std::string& task, int way) {
    const auto cut_before = [&](std::size_t end) { return task.substr(0, Below(static_cast<int>(end))); };
    switch (way % 4) {
      case 0: return cut_before(task.find("\ntask:"));  // which is required
      case 1: return cut_before(task.size()) + "\nno_such_key: 1\n";
      case 2: return Replaced(task, "dt: 0.1, ", "dt: .nan, ");
      default: return Replaced(task, "\ntransitions: ", "\ntransitions: /there_is_none");
    }
  }

  // Each would make a plain open or read of it wait for ever, never end, or fail.
  void PutNoFile(const std::string& path, int way) {
    std::filesystem::remove_all(path);
    switch (way % 4) {
      case 0:
        if (::mkfifo(path.c_str(), 0600) != 0) throw std::runtime_error(path + ": no pipe can be made");
        return;
      case 1: return std::filesystem::create_symlink("/dev/zero", path);
      case 2: return (void)std::filesystem::create_directory(path);
      default: return std::filesystem::create_symlink(path, path);  // cannot be read, not even by root
    }
  }

  void ReloadOfNoFile(Rig& rig) {
    Row& row = Begin("Reload of a pipe, /dev/zero, a directory, an unreadable file");
    const std::string path = rig.task_path(), good = rig.task();
    Tries(row, rig, [&](int i) {
      const certifier_status_t before = *rig.witness().status();
      const auto& now = rig.witness().status();
      PutNoFile(path, i);
      rig.Signal(Rig::kRobot, SIGHUP);
      rig.Command(command_t::RELOAD);
      DemandRefusedAndCertifying(row, rig, before);
      Demand(row, now->version == before.version, "it raised the version");
      const bool ends = i / 4 % 2 == 1;
      if (ends) rig.End(Rig::kCertifier);  // that it ends in time is looked at after each try
      std::filesystem::remove_all(path);
      std::ofstream(path) << good;
      if (ends) return;
      DemandTaken(row, rig, before);
    });
  }
};

}  // namespace

void Kills(Campaign& campaign) { Hurt(campaign).Kills(); }
void Stops(Campaign& campaign) { Hurt(campaign).Stops(); }
void LatchedKills(Campaign& campaign) { Hurt(campaign).LatchedKills(); }
void Reloads(Campaign& campaign) { Hurt(campaign).Reloads(); }

}  // namespace forereach
