#include "task/model_file.h"

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <vector>

#include "command_line/nearest.h"
#include "task/config_error.h"

namespace forereach {
namespace {

namespace fs = std::filesystem;

// The directories of config/ beside the running program: of <prefix>/bin and <prefix>/libexec/forereach. At most one of
// them exists.
std::vector<fs::path> InstalledDirectories() {
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  std::vector<fs::path> directories;
  for (const char* up : {"..", "../.."})
    directories.push_back((program / up / "share/forereach/config").lexically_normal());
  return directories;
}

std::string PlaceOf(const fs::path& directory) {
  std::error_code error;
  if (directory.empty()) return ".";
  return directory.string() + (fs::is_directory(directory, error) ? "" : " (which does not exist)");
}

// The model files beside a path that does not exist, named as it is.
void AddNeighbours(const fs::path& path, const fs::path& name, std::vector<std::string>& names) {
  std::error_code error;
  for (fs::directory_iterator file(path.parent_path(), error), end; !error && file != end; file.increment(error))
    if (file->path().extension() == ".yaml") names.push_back((name.parent_path() / file->path().filename()).string());
}

}  // namespace

std::string InstalledSchema() {
  std::error_code error;
  for (const fs::path& directory : InstalledDirectories())
    if (const fs::path schema = directory.parent_path() / "task.schema.json"; fs::exists(schema, error))
      return schema.string();
  return "";
}

std::string FindModelFile(const std::string& task, const std::string& name, const std::string& named_by) {
  std::vector<fs::path> directories = InstalledDirectories();
  // A model beside the task goes before one of the same name that is installed.
  directories.insert(directories.begin(), fs::path(task).parent_path());
  std::vector<std::string> neighbours;
  std::error_code error;
  for (const fs::path& directory : directories) {
    const fs::path path = directory / name;
    if (fs::exists(path, error)) return path.string();
    AddNeighbours(path, name, neighbours);
  }
  std::ranges::sort(neighbours);
  std::string where;
  for (const fs::path& directory : directories) where += (where.empty() ? "" : " nor in ") + PlaceOf(directory);
  throw ConfigError("{}{} is not in {}{}", named_by, name, where,
                    neighbours.empty() ? "" : "; " + Suggestion(name, neighbours));
}

}  // namespace forereach
