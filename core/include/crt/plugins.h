/// The backends that are installed with crt.
#pragma once

#include <crt/export.h>
#include <crt/watch.h>

#include <cstdint>
#include <string>
#include <vector>

CRT_API_NAMESPACE_BEGIN

struct Device {
    std::uint32_t index = 0;  ///< Stable within one machine and driver: RenderOptions::device.
    std::string name, driver;
    std::uint64_t memory_bytes = 0;  ///< 0: unknown.
};

struct Plugin {
    std::string name;  ///< RenderOptions::backend.
    std::string path;  ///< Empty: not installed.
    std::string version;
    std::vector<Device> devices;  ///< Best first.
    std::string reason;           ///< Reason why it cannot run here; empty if it can.
};

/// cuda, embree, opencl, and what else lies in the folders of CRT_BACKEND_PATH and in lib/crt beside libcrt.
/// Opens each.
CRT_API std::vector<Plugin> listPlugins(Watch* watch = nullptr);

/// "0.1.0", of this libcrt.
CRT_API const char* version();
/// Films and images of the same scene have the same bits in every crt with the same number.
CRT_API unsigned bitsVersion();

CRT_API_NAMESPACE_END
