/// The options of commands that render a scene into files.
#pragma once

#include "cli/command.h"
#include "cli/progress.h"
#include "render/job.h"

namespace crt {

/// The number of samples, and changes to the scene. All of these write to `job`, which must outlive them.
OptionGroup samplesGroup(Job& job);
OptionGroup deviceGroup(Job& job);
OptionGroup filesGroup(Job& job);
OptionGroup messagesGroup(ProgressMode& progress);

}  // namespace crt
