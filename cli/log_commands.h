/** The commands that work on recordings as files, and the one that follows the live bus. */
#pragma once

#include "cli/commands.h"
#include "cli/offline.h"

namespace forereach {

inline constexpr OfflineCommand kExport{"export",
                                        "Write a recorded run for other programs: tables (csv, jsonl), tubes as NumPy "
                                        "arrays (npz), messages (mcap): exit 0 "
                                        "if all of it could be read, otherwise 1"};
inline constexpr OfflineCommand kLogEdit{
    "log", "List, cut and merge LCM event logs: exit 0 if all of them could be read, 1 if one is damaged"};

inline constexpr OfflineCommand kLogCommands[] = {kExport, kLogEdit};

[[nodiscard]] Command ExportCommand();
[[nodiscard]] Command LogCommand();

/** Runs in `forereach` itself. */
[[nodiscard]] Command TailCommand();

}  // namespace forereach
