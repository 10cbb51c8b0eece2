/// Lists of devices, for backends whose struct Device has index, name, describe() and `unusable`: the reason
/// why it cannot be used, empty if it can.
#pragma once

#include "backend/sdk/plugin_guard.h"

#include <cstddef>
#include <string>
#include <vector>

namespace crt::gpu {

template <class Device>
std::vector<CrtDevice> describe(const std::vector<Device>& devices) {
    std::vector<CrtDevice> described;
    for (const Device& device : devices) described.push_back(device.describe());
    return described;
}

/// "0 'name' has no compiler, …" for each that cannot be used.
template <class Device>
std::string listUnusable(const std::vector<Device>& devices) {
    std::string list;
    for (const Device& device : devices)
        if (!device.unusable.empty())
            list += (list.empty() ? "" : ", ") + std::to_string(device.index) + " '" + device.name + "' " +
                    device.unusable;
    return list;
}

/// The devices that can be used. Throws PluginError(CRT_NO_DEVICE) with `none` and the reasons if there is
/// none.
template <class Device>
std::vector<Device> usable(const std::vector<Device>& devices, const std::string& none) {
    std::vector<Device> found;
    for (const Device& device : devices)
        if (device.unusable.empty()) found.push_back(device);
    if (found.empty()) throw plugin::PluginError(CRT_NO_DEVICE, none + ": " + listUnusable(devices));
    return found;
}

/// The usable device that --device means (crt::plugin::chooseDevice). Throws as usable() does, and if no
/// usable one is meant.
template <class Device>
Device choose(const std::vector<Device>& devices, const std::string& none, const char* wanted) {
    const std::vector<Device> found = usable(devices, none);
    const std::vector<CrtDevice> described = describe(found);
    try {
        return found[static_cast<std::size_t>(&plugin::chooseDevice(described, wanted) - described.data())];
    } catch (const plugin::PluginError& error) {
        const std::string others = listUnusable(devices);
        if (others.empty()) throw;
        throw plugin::PluginError(error.status(), error.what() + ("; not usable: " + others));
    }
}

}  // namespace crt::gpu
