/// The shared parts of the fuzz targets: files in memory, and the rule for results of hostile input.
#pragma once

#include "base/error.h"
#include "base/log.h"
#include "base/temporary_folder.h"

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace crt::fuzz {

/// A finding that no sanitizer sees.
[[noreturn]] inline void finding(const char* what, const char* detail) {
    std::fprintf(stderr, "FINDING: %s: %s\n", what, detail);
    std::abort();
}

/// Number of times that a body came to its end: seeds must (replay.cpp), or nothing behind the first refusal
/// is ever fuzzed.
inline int accepted = 0;

/// Runs `body`. Hostile input may be refused, by an error that says whose fault it is; it may not find a bug
/// in crt (Internal), and nothing but crt::Error may come out: std::bad_alloc or std::out_of_range would
/// reach the user as an internal error.
template <class Body>
void expectRefusalOrSuccess(ErrorKind refusal, Body&& body) {
    try {
        body();
        ++accepted;
    } catch (const Error& error) {
        if (error.kind() != refusal) finding("refused as the wrong kind of error", error.what());
        if (error.what()[0] == '\0') finding("refused", "without a word");
        if (printable(error.what()) != error.what()) finding("refused in no text", error.what());
    } catch (const std::exception& exception) {
        finding("not a crt::Error", exception.what());
    }
}

/// A directory, in memory where there is one, where this process keeps the files of one run.
class Directory {
public:
    Directory()
        : folder_(::access("/dev/shm", W_OK) == 0 ? std::filesystem::path("/dev/shm")
                                                  : std::filesystem::temp_directory_path()) {}

    std::string file(const char* name) const { return folder_ / name; }
    std::string path() const { return folder_.path(); }

    /// Overwrites a file and returns its path.
    std::string write(const char* name, const void* bytes, std::size_t size) const {
        std::string path = file(name);
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
        if (descriptor < 0 || ::write(descriptor, bytes, size) != static_cast<ssize_t>(size))
            finding("cannot write", path.c_str());
        ::close(descriptor);
        return path;
    }
    std::string write(const char* name, std::string_view text) const {
        return write(name, text.data(), text.size());
    }

private:
    const Listener listener_{{}, LogLevel::Off};
    const ListenerScope scope_{listener_};  // Warnings about odd input would be most of the output.
    TemporaryFolder folder_;
};

}  // namespace crt::fuzz
