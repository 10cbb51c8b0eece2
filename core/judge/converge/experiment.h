/// The settings that define a run of `crt converge`. It is written into the folder when the run begins, so
/// that --resume can refuse to mix rows of two.
#pragma once

#include "base/host.h"
#include "judge/converge/measurement.h"
#include "render/job.h"
#include "scene/scene.h"

#include <string>
#include <utility>
#include <vector>

namespace crt::converge {

/// Properties of one configuration, or of all (with an empty key), as (name, text).
struct Properties {
    Key key;
    std::vector<std::pair<std::string, std::string>> values;
};
using Experiment = std::vector<Properties>;

/// Settings that all configurations share: the program and its options.
Properties commonProperties(const BuildInfo& build, const IntegratorOptions& options);
/// Of a scene variant; `content`: its hashOfContent(); `reference`: what it is measured against, in words or
/// as a hash.
Properties propertiesOf(const Key& key, const Scene& scene, const std::string& content,
                        const std::string& reference);

/// One call of the program that rendered into the folder: the first, and those that resumed it.
struct SessionOfRun {
    std::string command;       ///< As typed, quoted for a shell.
    std::string started;       ///< UTC, ISO 8601.
    double spent_seconds = 0;  ///< As of the last replicate that it finished, or of its report.
};
/// Nothing where there is no such file.
std::vector<SessionOfRun> readSessions(const std::string& path);
void writeSessions(const std::string& path, const std::vector<SessionOfRun>& sessions);

void writeExperiment(const std::string& path, const Experiment& experiment);

/// Throws crt::Error(Usage) that names what differs from the experiment in the file, or says that there is
/// none.
void requireSameExperiment(const std::string& path, const Experiment& experiment);

/// One name for each scene: that of its file, with its folder where two files have the same. Throws
/// crt::Error(Usage) when one file is named twice: its rows would be taken for replicates of each other.
std::vector<std::string> namesOfScenes(const std::vector<SceneRequest>& scenes);

/// Throws crt::Error(Usage) when a name is in the list twice. `option`: e.g. "--backends".
void refuseRepeats(const std::vector<std::string>& names, const std::string& option);

}  // namespace crt::converge
