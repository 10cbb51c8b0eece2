#include "api/border.h"
#include "backend/loader.h"
#include "kernel/dialect/bits_version.h"

namespace crt::v0 {

std::vector<Plugin> listPlugins(Watch* watch) {
    return api::acrossBorder(watch, [] {
        std::vector<Plugin> plugins;
        for (const BackendStatus& status : listBackends()) {
            Plugin& plugin =
                plugins.emplace_back(Plugin{status.name, status.path, status.version, {}, status.reason});
            for (const CrtDevice& device : status.devices)
                plugin.devices.push_back(
                    {device.index, arrayText(device.name), arrayText(device.driver), device.memory_bytes});
        }
        return plugins;
    });
}

const char* version() { return CRT_VERSION; }
unsigned bitsVersion() { return CRT_BITS_VERSION; }

}  // namespace crt::v0
