/// The subcommands of crt beside render (job.h): one function each, from checked arguments to an exit code.
/// What they print goes to stdout.
#pragma once

#include "cli/progress.h"
#include "judge/compare/compare.h"
#include "judge/compare/compare_backends.h"
#include "render/job.h"

#include <array>
#include <optional>
#include <string>
#include <vector>

namespace crt {

/// `crt info`: what a scene needs, or what a film or an image holds, by the name's extension.
int showInfo(const SceneRequest& what);

/// `crt compare A B`: exit code 7 when the images differ (compare.h says what that means). `crt compare
/// --backends X,Y SCENE`: 7 when the verdict is not PASS.
struct CompareArguments {
    std::string first, second;    ///< With backends, the first is the scene and there is no second.
    CompareOptions options;
    std::string reference;        ///< An image that both are measured against; empty: none.
    std::string json_file;        ///< "-" for stdout, then instead of the text; empty: none.
    std::string difference_file;  ///< Empty: none.
    std::string map_file;         ///< Of z; empty: none.
    SceneRequest scene;           ///< How to change the scene; its name is in `first`.
    BackendComparisonOptions backends;
    ProgressMode progress = ProgressMode::Auto;
};
int compare(const CompareArguments& arguments);

/// `crt merge`: disjoint partial films into one film, or into images.
struct MergeArguments {
    std::vector<std::string> parts;
    std::vector<std::string> outputs;
    bool overwrite = false;  ///< Also over a film of more samples.
    SceneRequest scene;  ///< As rendered, for films that do not say themselves how to develop them; an empty
                         ///< name means none.
};
int mergeFilms(const MergeArguments& arguments);

/// `crt develop`: images of films, with other exposure, white balance, colour space or crop window than the
/// scene's, and without a backend or the scene. Films of disjoint samples are added up first.
struct DevelopArguments {
    std::vector<std::string> films;
    std::vector<std::string> outputs;
    std::vector<SceneOverride> changes;  ///< Keys of `film` that no sample depends on; others are refused.
    std::optional<std::array<int, 4>> crop;  ///< Of the whole film; x0, y0, x1, y1, half open.
    std::vector<std::string> aovs;           ///< Of EXR files; empty: those of the scene. "none": none.
};
int develop(const DevelopArguments& arguments);

/// `crt plugins`: every backend, its devices, or the one reason why it cannot run.
int listPlugins();

/// `crt schema`: the keys of scene files, as JSON Schema or as the reference manual.
int printSchema(bool markdown);

}  // namespace crt
