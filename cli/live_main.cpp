/** forereach-live: started by `forereach live` with the same arguments. */
#include "cli/commands.h"

int main(int argc, char** argv) { return forereach::RunCommands({forereach::LiveCommand()}, argc, argv); }
