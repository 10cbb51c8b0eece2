/// crt's one exception type. Inside the core everything that can go wrong is thrown as crt::Error; the
/// program turns it into one message and an exit code, the plugin border into a status.
#pragma once

#include "base/words.h"

#include <stdexcept>
#include <string>
#include <utility>

namespace crt {

/// The place in an input file to which a message points. `line` and `column` count from 1; 0 means unknown.
struct SourcePlace {
    std::string file;
    int line = 0;
    int column = 0;

    /// "scene.yaml:3:5", as far as it is known: what begins a message.
    std::string text() const {
        std::string place = file;
        for (const int number : {line, column}) {
            if (number <= 0) break;
            place += ':' + std::to_string(number);
        }
        return place;
    }
};

/// Kind of the failure. The values are the program's exit codes (docs/architecture.md, "Exit codes").
enum class ErrorKind : int {
    Internal = 1,  ///< A broken invariant: a bug in crt.
    Usage = 2,     ///< The command line is wrong.
    Scene = 3,     ///< The scene, or a file it names, is wrong.
    Backend = 4,   ///< Backend or device not available, or refused.
    Device = 5,    ///< The device failed while rendering.
    Output = 6,    ///< An output cannot be written.
};

/// One sentence, what kind it is, and the place it points to. The sentence is printable, whatever it quotes.
class Error : public std::runtime_error {
public:
    Error(ErrorKind kind, const std::string& sentence, SourcePlace place = {})
        : std::runtime_error(printable(sentence)), kind_(kind), place_(std::move(place)) {}

    /// The same, said of a device whose memory did not suffice: with less to hold it may go well.
    Error&& lackingMemory() && {
        lacks_memory_ = true;
        return std::move(*this);
    }

    ErrorKind kind() const noexcept { return kind_; }
    bool lacksMemory() const noexcept { return lacks_memory_; }
    const SourcePlace& place() const noexcept { return place_; }
    int exitCode() const noexcept { return static_cast<int>(kind_); }

private:
    ErrorKind kind_;
    SourcePlace place_;
    bool lacks_memory_ = false;
};

}  // namespace crt
