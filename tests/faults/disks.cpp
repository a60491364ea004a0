// Disks that are full or read-only, and logs that are deleted while they are written.
#include <filesystem>
#include <fstream>

#include <sys/mount.h>

#include "tests/faults/demo_task.h"
#include "tests/faults/kind.h"

namespace forereach {
namespace {

struct Filled final : Kind {
  using Kind::Kind;

  // The same for the certifier's state.
  void StateDisks() {
    const ScratchDirectory scratch;
    const std::string directory = scratch.path(), filler = directory + "/filler", latch = directory + "/latch.json";
    constexpr const char* kSize = "size=1m";
    if (::mount("tmpfs", directory.c_str(), "tmpfs", 0, kSize) != 0)
      return NotTried("A full or read-only disk for the certifier's state", "mounting a small file system needs root");
    {
      Rig rig(DemoTask());
      rig.End(Rig::kCertifier);
      rig.SetState(directory);
      const auto fill = [&] { std::ofstream(filler) << std::string(2 << 20, 'x'); };
      const auto remount = [&](Row& row, unsigned long how) {
        Demand(row, ::mount("tmpfs", directory.c_str(), "tmpfs", MS_REMOUNT | how, kSize) == 0, "no remount");
      };
      // Nothing is certified, and it is said why.
      const auto demand_not_armed = [&](Row& row, const std::string& why) {
        const std::int64_t certificates = rig.witness().certificates();
        rig.witness().Forget();
        rig.Start(Rig::kCertifier);
        const auto says_so = [&] {
          const auto& status = rig.witness().status();
          return status && status->level == certifier_status_t::ERROR &&
                 status->state == certifier_status_t::DISARMED &&
                 GetText(status->message).starts_with("no fault could be stored");
        };
        Demand(row, rig.ListenUntil(says_so, kStarts), why + ", and the certifier does not say so");
        rig.Listen(milliseconds(1000));
        Demand(row, rig.witness().certificates() == certificates, why + ", and the certifier certified");
      };
      Row& at_start = Begin("The certifier's state on a disk that is full at its start");
      Tries(at_start, rig, [&](int) {
        rig.End(Rig::kCertifier);
        std::filesystem::remove(latch);
        fill();
        demand_not_armed(at_start, "no fault could be written");
        std::filesystem::remove(filler);
      });

      Row& later = Begin("The certifier's state on a disk that is full when a fault is latched, then SIGKILL");
      std::int64_t sequence = Witness::kFirstLie;
      Tries(later, rig, [&](int) {
        fill();
        const std::optional<fault_t> fault = Provoke(later, rig, sequence++);
        rig.End(Rig::kCertifier, SIGKILL);
        rig.Start(Rig::kCertifier);
        if (fault) DemandStillLatched(later, rig, *fault);
        std::filesystem::remove(filler);
      });

      Row& read_only = Begin("The certifier's state read-only at its start");
      Tries(read_only, rig, [&](int) {
        rig.End(Rig::kCertifier);
        remount(read_only, MS_RDONLY);
        demand_not_armed(read_only, "the disk was read-only");
        remount(read_only, 0);
      });
    }
    ::umount(directory.c_str());
  }

  // A small file system of its own for the log, filled, made read-only, and given back.
  void Disks() {
    const ScratchDirectory scratch;
    const std::string directory = scratch.path();
    constexpr const char* kSize = "size=32m";
    if (::mount("tmpfs", directory.c_str(), "tmpfs", 0, kSize) != 0)
      return NotTried("Full disk, read-only directory", "mounting a small file system needs root");
    {
      Rig rig(DemoTask("logger: {min_free_mb: 1}\n"));
      rig.SetDirectory(directory);
      rig.End(Rig::kLogger);  // it is started again there
      Row& full = Begin("Full disk");
      Tries(full, rig, [&](int) {
        const std::string filler = directory + "/filler";  // as much as there is room for
        std::ofstream(filler) << std::string(32 << 20, 'x');
        rig.Listen(milliseconds(700));
        const auto says_so = [&] {
          const auto& logger = rig.witness().logger_status();
          return logger && logger->state == logger_status_t::ERROR;
        };
        Demand(full, rig.ListenUntil(says_so, kSaysSoon), "the disk was full, and the logger's state was not ERROR");
        std::filesystem::remove(filler);
      });

      // While a file is open to be written the kernel refuses it, so it is done before the logger starts.
      Row& read_only = Begin("Log directory read-only at the logger's start");
      const auto remount = [&](unsigned long how) {
        Demand(read_only, ::mount("tmpfs", directory.c_str(), "tmpfs", MS_REMOUNT | how, kSize) == 0, "no remount");
      };
      Tries(read_only, rig, [&](int) {
        rig.End(Rig::kLogger);
        remount(MS_RDONLY);
        ChildProcess logger({FOREREACH_LOGGER, "--config", rig.task_path(), "--lcm-url", rig.url(Rig::kLogger),
                             "--directory", directory});
        const bool says_why =
            logger.WaitForExit(std::chrono::seconds(10)) == 2 && logger.error().find(directory) != std::string::npos;
        Demand(read_only, says_why, "the logger did not end with the reason: " + logger.error());
        remount(0);
      });
    }
    ::umount(directory.c_str());
  }

  // What the logger writes is deleted while it writes. It says so, counts what had been confirmed, and records again.
  void Gone() {
    const auto remove_files = [](const std::string& directory, const std::string& part) {
      std::error_code error;
      for (const auto& file : std::filesystem::directory_iterator(directory, error))
        if (file.path().filename().string().find(part) != std::string::npos)
          std::filesystem::remove(file.path(), error);
    };
    const std::vector<std::pair<const char*, std::function<void(const std::string&)>>> kinds{
        {"Log file deleted", [&](const std::string& directory) { remove_files(directory, ".lcmlog"); }},
        {"Log directory deleted", [](const std::string& directory) { std::filesystem::remove_all(directory); }},
        {"Database deleted", [&](const std::string& directory) { remove_files(directory, "decisions.sqlite"); }}};
    for (const auto& kind : kinds) {
      const char* const fault = kind.first;
      const auto& take_away = kind.second;
      const bool is_database = &take_away == &kinds.back().second;
      Rig rig(DemoTask(), {.takes_logs_away = true});
      Row& row = Begin(fault);
      std::int64_t gone = 0;
      const auto& logger = rig.witness().logger_status();
      Tries(row, rig, [&](int) {
        rig.Listen(kHeartbeat);
        const logger_status_t before = *logger;
        take_away(rig.directory());
        const auto says_so = [&] {
          return is_database ? logger->state == logger_status_t::STALE : logger->events_lost > before.events_lost;
        };
        Demand(row, rig.ListenUntil(says_so, kStarts), "it does not say what is lost: " + GetText(logger->message));
        // Whatever there is to record: under load a drive may have ended by now.
        const std::int64_t said = logger->events_written;
        const auto goes_on = [&] { return logger->events_written > said && logger->state != logger_status_t::ERROR; };
        Demand(row, rig.ListenUntil(goes_on, kStarts), "it does not record again: " + GetText(logger->message));
        Demand(row, is_database || logger->events_lost - before.events_lost >= before.events_written - gone,
               "it counts less as lost than it had confirmed");
        gone += logger->events_lost - before.events_lost;
        if (is_database) rig.End(Rig::kLogger), gone = 0;  // the next one makes the rows again
      });
      Remark(row, is_database ? "the next start makes the rows again"
                              : "lost are the events that were deleted, and counted");
      if (!is_database) row.lost_by_logger.reset();
    }
  }
};

}  // namespace

void StateDisks(Campaign& campaign) { Filled(campaign).StateDisks(); }
void Disks(Campaign& campaign) { Filled(campaign).Disks(); }
void Gone(Campaign& campaign) { Filled(campaign).Gone(); }

}  // namespace forereach
