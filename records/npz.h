/** Writes NumPy's .npz files: a zip file of arrays, each a .npy file (numpy.lib.format, version 1.0). */
#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "records/output_file.h"

namespace forereach {

/** Arrays that grow row by row. The rows wait in files without a name beside the output, not in memory. */
class NpzWriter final {
 public:
  /** All throw OutputError if the file cannot be written. */
  explicit NpzWriter(OutputFile file) : file_(std::move(file)) {}

  /** One more row of a matrix of doubles. Rows may differ in length, up to kMostColumns: Finish fills the shorter ones
  with NaN. */
  void AddRow(const std::string& name, std::span<const double> row);
  /** One more entry of a vector of integers. */
  void Add(const std::string& name, std::int64_t value);
  /** One more entry of a vector of texts, cut to kMostText bytes. */
  void Add(const std::string& name, std::string_view text);
  /** An array without entries if none follow. @param kind 'f' as AddRow makes them, 'i' or 'S'. */
  void Declare(const std::string& name, char kind);

  /** Writes the zip file. Without it nothing is left of the file. */
  void Finish();

  static constexpr std::size_t kMostColumns = 16, kMostText = 255;

 private:
  struct Array {
    char kind;
    std::int64_t rows = 0;
    std::size_t width = 0;  // of the longest row
    OutputFile spool;
  };

  Array& Of(const std::string& name, char kind);

  OutputFile file_;
  std::map<std::string, Array> arrays_;
};

}  // namespace forereach
