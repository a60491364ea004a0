#include "lcmtypes/why_failed.h"

#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>
#include <typeinfo>

#include "lcmtypes/bad_input.h"

namespace forereach {

std::string WhyFailed(const std::exception& error) {
  const bool is_ours = dynamic_cast<const BadInput*>(&error) || dynamic_cast<const std::invalid_argument*>(&error) ||
                       typeid(error) == typeid(std::runtime_error);  // libraries throw classes derived from it
  if (is_ours) return error.what();
  if (dynamic_cast<const std::bad_alloc*>(&error) || dynamic_cast<const std::length_error*>(&error))
    return "there is not enough memory";
  if (const auto* file = dynamic_cast<const std::filesystem::filesystem_error*>(&error))
    return file->path1().string() + ": " + file->code().message();
  if (const auto* system = dynamic_cast<const std::system_error*>(&error)) return system->code().message();
  return "an error of this program, not of its input: please report it with what it was given";
}

}  // namespace forereach
