#include "certifier/numerics/lanes.h"

namespace forereach {

InstructionSet active_instruction_set = BestInstructionSet();

}  // namespace forereach
