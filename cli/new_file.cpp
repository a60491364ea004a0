#include "cli/new_file.h"

#include <filesystem>

#include "records/output_file.h"

namespace forereach {

void RequireNewFile(const std::string& path, bool force) {
  std::error_code error;
  if (!force && std::filesystem::exists(std::filesystem::symlink_status(path, error)))
    throw OutputError(path + ": the file exists, and is not changed; choose another name, or write --force");
}

void WriteNewFile(const std::string& path, const std::string& text, bool force) {
  RequireNewFile(path, force);
  OutputFile file(path, force ? OutputFile::Existing::kReplaced : OutputFile::Existing::kKept);
  file.Write(text);
  file.Close();
}

}  // namespace forereach
