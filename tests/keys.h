/** Keys for tests: the same in every run. */
#pragma once

#include <string>

#include "bus/keys.h"

namespace forereach {

/** All roles of a robot. */
inline KeyRing TestKeys(const std::string& robot = "test") {
  return MakeKeyRing(robot, DigestOf("entropy of " + robot));
}

/** Makes a directory of keys, and returns its path. */
inline std::string MakeTestKeys(const std::string& directory, const std::string& robot = "test") {
  MakeKeys(robot, directory);
  return directory;
}

}  // namespace forereach
