/// The commands of crt: one file each, which declares its options and runs it. Their output goes to standard
/// output, messages go to standard error.
#pragma once

#include "cli/command.h"

namespace crt {

class CommandLine;

Command renderCommand();
Command sequenceCommand();
Command viewCommand();
Command infoCommand();
Command importCommand();
Command compareCommand();
Command mergeCommand();
Command developCommand();
Command denoiseCommand();
Command convergeCommand();
Command referenceCommand();
Command verifyCommand();
Command pluginsCommand();
Command warmCommand();
Command dataCommand();
Command schemaCommand();
Command versionCommand();
/// These two describe the others: `all` must outlive them.
Command helpCommand(const CommandLine& all);
Command completionCommand(const CommandLine& all);

}  // namespace crt
