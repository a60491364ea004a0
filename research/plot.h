/** Pictures of a run, drawn by gnuplot. */
#pragma once

#include <filesystem>
#include <initializer_list>
#include <string>

namespace forereach::research {

/** A gnuplot script without terminal and output, its data within. */
struct Plot {
  std::string name;     ///< Of the files: letters, digits, '-' and '_'
  std::string caption;  ///< In Markdown, one line
  int width = 720, height = 440;
  std::string script;
};

/** "$name << EOD", the lines, "EOD": data within a script. */
[[nodiscard]] std::string DataBlock(const std::string& name, const std::string& lines);
/** The numbers with blanks between, and a line's end; "NaN" is a gap. */
[[nodiscard]] std::string DataLine(std::initializer_list<double> numbers);

/** Writes the script to `scripts`/NAME.gp and its picture to `pictures`/NAME.svg; makes both directories.
@return false, having said so on standard error, if there is no gnuplot or it fails. @throws std::runtime_error naming a
file that cannot be written. */
bool Draw(const Plot& plot, const std::filesystem::path& scripts, const std::filesystem::path& pictures);

}  // namespace forereach::research
