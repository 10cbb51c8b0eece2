#include "backend/loader.h"
#include "base/standard_output.h"
#include "base/unit_text.h"
#include "cli/commands.h"
#include "cli/row.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <memory>
#include <string>

namespace crt {
namespace {

int listPlugins() {
    for (const BackendStatus& status : listBackends()) {
        printOut("{}{}\n", status.name, status.version.empty() ? "" : " " + status.version);
        if (!status.path.empty()) printRow("file", status.path);
        if (!status.build.empty()) printRow("built with", status.build);
        for (const CrtDevice& device : status.devices) {
            std::string text = fmt::format("{}: {}", device.index, device.name);
            if (device.memory_bytes > 0) text += ", " + bytesText(static_cast<double>(device.memory_bytes));
            if (*device.driver != '\0') text += fmt::format(", {}", device.driver);
            printRow("device", text);
        }
        if (!status.reason.empty()) printRow(status.refused ? "refused" : "cannot run", status.reason);
    }
    return 0;
}

/// The same for programs: everything that is known, null where a backend does not say it.
int printPluginsJson() {
    using Json = nlohmann::ordered_json;
    const auto text = [](const std::string& value) { return value.empty() ? Json() : Json(value); };
    Json backends = Json::array();
    for (const BackendStatus& status : listBackends()) {
        Json devices = Json::array();
        for (const CrtDevice& device : status.devices)
            devices.push_back(
                {{"index", device.index},
                 {"name", arrayText(device.name)},
                 {"memory_bytes", device.memory_bytes > 0 ? Json(device.memory_bytes) : Json()},
                 {"driver", text(arrayText(device.driver))}});
        backends.push_back({{"name", status.name},
                            {"version", text(status.version)},
                            {"file", text(status.path)},
                            {"built_with", text(status.build)},
                            {"usable", status.reason.empty()},
                            {"refused", status.refused},
                            {"reason", text(status.reason)},
                            {"devices", std::move(devices)}});
    }
    // Names come from drivers, in whatever encoding.
    printOut("{}\n",
             Json{{"backends", std::move(backends)}}.dump(2, ' ', false, Json::error_handler_t::replace));
    return 0;
}

}  // namespace

Command pluginsCommand() {
    const auto json = std::make_shared<bool>(false);
    return {.name = "plugins",
            .summary = "list the backends and their devices, and explain why one cannot run",
            .groups = {{"Options",
                        {{.names = "--json",
                          .placeholder = {},
                          .help = "the same as JSON",
                          .read = [json](const std::string&) { *json = true; }}}}},
            .run = [json](const std::string&) { return *json ? printPluginsJson() : listPlugins(); }};
}

}  // namespace crt
