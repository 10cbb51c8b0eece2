/// Drops all messages of this thread during its lifetime.
#pragma once

#include "base/listener.h"

#include <string_view>

namespace crt {

class NullListener {
public:
    NullListener() : listener_([](LogLevel, std::string_view) {}, LogLevel::Off), scope_(listener_) {}

private:
    const Listener listener_;
    const ListenerScope scope_;
};

}  // namespace crt
