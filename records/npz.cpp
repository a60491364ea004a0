#include "records/npz.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <minizip/zip.h>

namespace forereach {
namespace {

static_assert(std::endian::native == std::endian::little, "the arrays are written as they lie in memory");

// A row of a spool: of 16 doubles, one integer, or a text of 255 bytes.
std::size_t SpoolBytes(char kind) {
  return kind == 'f' ? NpzWriter::kMostColumns * sizeof(double)
                     : (kind == 'i' ? sizeof(std::int64_t) : NpzWriter::kMostText);
}

// Magic, version 1.0, the length of the text behind it, and that text, padded so that the data begin at a multiple
// of 64.
std::string NpyHeader(char kind, std::int64_t rows, std::size_t width) {
  const std::string type = kind == 'f' ? "<f8" : (kind == 'i' ? "<i8" : fmt::format("|S{}", width));
  std::string text = fmt::format("{{'descr': '{}', 'fortran_order': False, 'shape': ({}, {}), }}", type, rows,
                                 kind == 'f' ? std::to_string(width) : "");
  constexpr std::size_t before = 10;
  text.append(63 - (before + text.size()) % 64, ' ').push_back('\n');
  std::string header("\x93NUMPY\x01\x00", 8);
  header.push_back(static_cast<char>(text.size() & 0xff));
  header.push_back(static_cast<char>(text.size() >> 8));
  return header + text;
}

class Zip final {
 public:
  explicit Zip(OutputFile& file) : path_(file.path()) {
    zlib_filefunc64_def functions;
    fill_fopen64_filefunc(&functions);
    functions.opaque = file.stream();
    functions.zopen64_file = [](voidpf stream, const void*, int) { return stream; };
    functions.zclose_file = [](voidpf, voidpf) { return 0; };  // the stream is the OutputFile's
    zip_ = zipOpen2_64("", APPEND_STATUS_CREATE, nullptr, &functions);
    Require(zip_ != nullptr);
  }
  ~Zip() {
    if (zip_) zipClose(zip_, nullptr);
  }
  Zip(const Zip&) = delete;
  Zip& operator=(const Zip&) = delete;

  void Begin(const std::string& name) {
    zip_fileinfo info{};
    info.tmz_date = {.tm_sec = 0, .tm_min = 0, .tm_hour = 0, .tm_mday = 1, .tm_mon = 0, .tm_year = 1980};
    constexpr int zip64 = 1;
    Require(zipOpenNewFileInZip64(zip_, name.c_str(), &info, nullptr, 0, nullptr, 0, nullptr, Z_DEFLATED, Z_BEST_SPEED,
                                  zip64) == ZIP_OK);
  }
  void Write(std::string_view bytes) {
    Require(zipWriteInFileInZip(zip_, bytes.data(), static_cast<unsigned>(bytes.size())) == ZIP_OK);
  }
  void End() { Require(zipCloseFileInZip(zip_) == ZIP_OK); }
  void Close() { Require(zipClose(std::exchange(zip_, nullptr), nullptr) == ZIP_OK); }

 private:
  void Require(bool done) const {
    if (!done) throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }

  const std::string path_;
  zipFile zip_ = nullptr;
};

}  // namespace

NpzWriter::Array& NpzWriter::Of(const std::string& name, char kind) {
  const auto found = arrays_.find(name);
  if (found != arrays_.end()) return found->second;
  return arrays_.emplace(name, Array{kind, 0, kind == 'S' ? 1u : 0u, OutputFile::Nameless(file_.path())}).first->second;
}

void NpzWriter::Declare(const std::string& name, char kind) { static_cast<void>(Of(name, kind)); }

void NpzWriter::AddRow(const std::string& name, std::span<const double> row) {
  Array& array = Of(name, 'f');
  std::array<double, kMostColumns> padded;
  padded.fill(std::numeric_limits<double>::quiet_NaN());
  const std::size_t width = std::min(row.size(), kMostColumns);
  std::copy_n(row.begin(), width, padded.begin());
  array.spool.Write({reinterpret_cast<const char*>(padded.data()), sizeof padded});
  array.width = std::max(array.width, width);
  ++array.rows;
}

void NpzWriter::Add(const std::string& name, std::int64_t value) {
  Array& array = Of(name, 'i');
  array.spool.Write({reinterpret_cast<const char*>(&value), sizeof value});
  array.width = sizeof value;
  ++array.rows;
}

void NpzWriter::Add(const std::string& name, std::string_view text) {
  Array& array = Of(name, 'S');
  std::string padded(text.substr(0, kMostText));
  array.width = std::max(array.width, padded.size());
  padded.resize(kMostText);
  array.spool.Write(padded);
  ++array.rows;
}

void NpzWriter::Finish() {
  Zip zip(file_);
  for (auto& [name, array] : arrays_) {
    zip.Begin(name + ".npy");
    zip.Write(NpyHeader(array.kind, array.rows, array.width));
    const std::size_t bytes = array.kind == 'f' ? array.width * sizeof(double) : array.width;
    std::string row(SpoolBytes(array.kind), '\0');
    std::rewind(array.spool.stream());
    for (std::int64_t i = 0; i < array.rows; ++i) {
      if (std::fread(row.data(), 1, row.size(), array.spool.stream()) != row.size())
        throw OutputError(fmt::format("{}: what was kept beside it cannot be read back", file_.path()));
      if (bytes > 0) zip.Write(std::string_view(row).substr(0, bytes));
    }
    zip.End();
  }
  zip.Close();
  file_.Close();
}

}  // namespace forereach
