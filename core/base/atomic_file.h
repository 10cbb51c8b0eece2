/// Files that are either whole or not there: written under a temporary name in the same directory, synced,
/// renamed. A reader of the final name, even after a crash, sees the old file or the new one, never half of
/// either.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace crt {

/// "-", or "-.png" where an extension must say the format: standard output instead of a file.
bool isStandardOutput(const std::string& path);

/// One file on its way to its final name. Every failure is a crt::Error(Output) naming the final file. [one
/// thread]
class AtomicFile {
public:
    /// Opens the temporary. A symbolic link is followed, so that the link stays and its target is replaced,
    /// or made where the link led to nothing. The temporary of standard output lies in the system's folder
    /// of temporary files.
    explicit AtomicFile(const std::string& path);
    /// Removes the temporary unless commit() succeeded.
    ~AtomicFile();
    AtomicFile(const AtomicFile&) = delete;
    AtomicFile& operator=(const AtomicFile&) = delete;

    /// Appends `size` bytes.
    void write(const void* bytes, std::size_t size);
    /// Path of the bytes until commit(): for libraries that write to a name rather than through write().
    const std::string& temporaryPath() const { return temporary_; }
    /// Waits until the bytes are on the disk, then gives the file its final name. Standard output gets all
    /// bytes at once, so that a render that fails sends none.
    void commit();

private:
    [[noreturn]] void fail(const char* what, int error_number) const;
    void openStreamed();
    void stream();

    std::string path_;       ///< As the caller named it, for messages.
    std::string final_;      ///< With symbolic links followed.
    std::string temporary_;
    int descriptor_ = -1;
    bool committed_ = false;
};

/// Finds out before a render, rather than after it, that `path` cannot be written: creates and removes a
/// temporary file beside it. Removes temporaries of the same file that killed processes left. Makes no
/// folder, which would hide a typing error. Throws crt::Error(Output) with one sentence. The only later
/// error is a full disk. Standard output that is a terminal is refused: it would show an image's bytes as
/// text.
void checkWritable(const std::string& path);

/// Makes the folder that a command fills, in one that is there already. Throws crt::Error(Output).
void makeOutputFolder(const std::string& path);

}  // namespace crt
