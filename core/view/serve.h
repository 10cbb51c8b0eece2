/// `crt view`: from the start to Ctrl-C.
#pragma once

#include "view/viewer.h"

#include <cstdint>
#include <string>

namespace crt {

struct ServeOptions {
    std::uint16_t port = 0;  ///< 0: any that is free.
    std::string token;       ///< Empty: a random one.
    bool open_browser = true;
};

/// Prints the address and serves it until SIGINT, SIGTERM or SIGHUP. Throws crt::Error(Usage) for a port
/// that is taken.
void serveView(const ViewOptions& view, const ServeOptions& serve);

}  // namespace crt
