/** The recorded course: tests/data/record records it. */
#pragma once

#include <string>

#include "tests/paths.h"

namespace forereach {

inline const std::string kCourseLog = FOREREACH_SOURCE_DIR "/tests/data/course.lcmlog";
inline const std::string kCourseTask = FOREREACH_SOURCE_DIR "/tests/data/course.yaml";

/** Its decisions; each is a certificate, or an abstention that some change would have turned. */
inline constexpr int kCourseDecisions = 97, kCourseCertified = 22,
                     kCourseAbstained = kCourseDecisions - kCourseCertified;

}  // namespace forereach
