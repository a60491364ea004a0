/** Where a task's robot may drive, for a world that is cut to it. */
#pragma once

#include "forereach/sets/box.h"
#include "task/config.h"

namespace forereach {

/** The positions of the task's domain, grown by the reach of its body and by how far the motion between two samples may
curve: in plain arithmetic, since what is outside of the region counts as occupied. Parts of the body at expressions
have no reach of their own. @throws ConfigError unless the task has two safety coordinates. */
[[nodiscard]] Box RegionOf(const Config& config);

}  // namespace forereach
