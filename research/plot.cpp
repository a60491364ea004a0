#include "research/plot.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <iostream>

#include <fmt/format.h>

#include "research/run_directory.h"

namespace forereach::research {
namespace {

namespace fs = std::filesystem;

// What all pictures share. Colors that colour-blind readers tell apart, after Okabe and Ito.
constexpr const char* kStyle = R"(set encoding utf8
set border 3 lc rgb '#666666'
set tics nomirror textcolor rgb '#333333'
set grid lc rgb '#e4e4e4' lt 1
set key Left reverse samplen 1.5 spacing 1.15
blue = '#0072B2'; red = '#D55E00'; green = '#009E73'; orange = '#E69F00'; purple = '#CC79A7'; sky = '#56B4E9'
grey = '#8a8a8a'
)";

// `gnuplot FILE > output`
bool RunGnuplot(const fs::path& file, const fs::path& output) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, output.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  std::string program = "gnuplot", path = file.string();
  char* const arguments[] = {program.data(), path.data(), nullptr};
  pid_t child = 0;
  const int failed = posix_spawnp(&child, program.c_str(), &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  return failed == 0 && waitpid(child, &status, 0) == child && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

}  // namespace

std::string DataBlock(const std::string& name, const std::string& lines) {
  return "$" + name + " << EOD\n" + lines + "EOD\n";
}

std::string DataLine(std::initializer_list<double> numbers) {
  std::string line;
  for (const double number : numbers)
    line += number == number ? fmt::format("{}{:.6g}", line.empty() ? "" : " ", number) : " NaN";
  return line + "\n";
}

bool Draw(const Plot& plot, const fs::path& scripts, const fs::path& pictures) {
  fs::create_directories(scripts);
  fs::create_directories(pictures);
  const fs::path script = scripts / (plot.name + ".gp"), picture = pictures / (plot.name + ".svg");
  const fs::path part = picture.string() + ".part";
  WriteFile(script, "set terminal svg size " + std::to_string(plot.width) + "," + std::to_string(plot.height) +
                        " dynamic enhanced font 'Helvetica,Arial,sans-serif,13' background '#ffffff'\n" + kStyle +
                        plot.script);
  if (!RunGnuplot(script, part)) {
    std::cerr << "No picture of " << script.string() << ": gnuplot is not there or failed.\n";
    fs::remove(part);
    return false;
  }
  fs::rename(part, picture);
  return true;
}

}  // namespace forereach::research
