#include "base/standard_output.h"
#include "cli/commands.h"
#include "scene/yaml/scene_yaml.h"

#include <memory>
#include <string>

namespace crt {
namespace {

int printSchema(bool markdown) {
    const std::string text = markdown ? sceneReferenceMarkdown() : sceneJsonSchema();
    printOut("{}{}", text, !text.empty() && text.back() == '\n' ? "" : "\n");
    return 0;
}

}  // namespace

Command schemaCommand() {
    const auto markdown = std::make_shared<bool>(false);
    return {.name = "schema",
            .summary = "print the JSON Schema of scene files",
            .groups = {{"Options",
                        {{.names = "--markdown",
                          .placeholder = {},
                          .help = "print the reference manual instead",
                          .read = [markdown](const std::string&) { *markdown = true; }}}}},
            .run = [markdown](const std::string&) { return printSchema(*markdown); }};
}

}  // namespace crt
