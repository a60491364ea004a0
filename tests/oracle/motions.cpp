// Continuous motions under certificates, without end: `forereach_motions --minutes M --seed S --jobs J`; exit 1 at a
// contact, with what repeats it. `--problem P` repeats one.

#include <atomic>
#include <chrono>
#include <iostream>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <mpfr.h>

#include "command_line/command_line.h"
#include "tests/oracle/motions.h"

int main(int argc, char** argv) {
  using namespace forereach;
  double minutes = 1;
  long only = -1;
  std::uint64_t seed = 1;
  unsigned jobs = 1;
  const Command program{
      .name = "forereach_motions",
      .purpose =
          "Certifies random plans among obstacles that the certifier just accepts, and follows continuous "
          "motions that the declarations admit. None of them may meet an obstacle.",
      .options = {{.name = "--minutes",
                   .variable = &minutes,
                   .help = "Begin no problem after this time",
                   .range = NumberRange{1e-3, 1e6}},
                  {.name = "--seed", .variable = &seed, .help = "Of the random numbers"},
                  {.name = "--jobs", .variable = &jobs, .help = "Threads", .range = NumberRange{1, 1e3}},
                  {.name = "--problem", .variable = &only, .help = "This problem only; negative: all"}}};
  if (const std::optional<int> code = ParseCommandLine(program, argc, argv)) return *code;

  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(60 * minutes);
  std::atomic<long> next = std::max(only, 0L);
  std::mutex mutex;
  Tally total;
  bool kept = true;
  const auto work = [&] {
    while (std::chrono::steady_clock::now() < end) {
      const long number = next++;
      if (only >= 0 && number > only) break;
      try {
        const Tally tally = MotionTrial(seed * 0x9e3779b97f4a7c15 + static_cast<std::uint64_t>(number)).Run(6);
        const std::lock_guard lock(mutex);
        total.Add(tally);
      } catch (const std::logic_error& error) {
        const std::lock_guard lock(mutex);
        kept = false;
        std::cerr << "broken promise: --seed " << seed << " --problem " << number << ": " << error.what() << std::endl;
      }
    }
    mpfr_free_cache2(MPFR_FREE_LOCAL_CACHE);  // of this thread
  };
  std::vector<std::thread> threads;
  for (unsigned j = 0; j < jobs; ++j) threads.emplace_back(work);
  for (std::thread& thread : threads) thread.join();
  std::cout << "seed " << seed << ": " << total.Text() << (kept ? "; no contact" : "; CONTACT") << std::endl;
  const bool enough = only >= 0 || total.certified > 0;
  return kept && enough ? 0 : 1;
}
