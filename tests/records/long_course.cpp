/** forereach_long_course DIRECTORY ROUNDS reload|learn: makes the directory of a logger that has recorded the course so
 * often. */
#include "tests/records/long_course.h"

#include "records/log_directory.h"

int main(int argc, char** argv) {
  using namespace forereach;
  if (argc != 4) return std::fprintf(stderr, "usage: forereach_long_course DIRECTORY ROUNDS reload|learn\n"), 2;
  const LogDirectory directory(argv[1]);
  Database database(directory.PathOf(LogDirectory::kDatabase));
  WriteLongCourse(directory.PathOf("events-20270115-080000-000000.lcmlog"), std::stoi(argv[2]), &database,
                  std::string_view(argv[3]) == "learn" ? Rounds::kLearn : Rounds::kReload);
  return testing::Test::HasFailure() ? 1 : 0;
}
