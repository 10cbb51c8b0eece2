#include "base/atomic_file.h"

#include "base/error.h"
#include "base/temporary_folder.h"
#include "base/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <optional>
#include <sys/file.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>
#include <vector>

namespace crt {
namespace fs = std::filesystem;
namespace {

std::string directoryOf(const std::string& path) {
    const std::string parent = fs::path(path).parent_path().string();
    return parent.empty() ? "." : parent;
}

/// "there is no folder 'ou'; did you mean 'out'?": nothing is made of what may be a typing error.
std::string missingFolder(const std::string& directory) {
    std::error_code error;
    fs::path missing = fs::path(directory).lexically_normal();
    if (!missing.has_filename()) missing = missing.parent_path();
    fs::path above = directoryOf(missing.string());
    while (!fs::exists(above, error) && above.has_parent_path() && above != above.parent_path()) {
        missing = above;
        above = directoryOf(above.string());
    }
    constexpr std::size_t kMostNeighbours = 1000;
    std::vector<std::string> neighbours;
    for (fs::directory_iterator entry(above, error), end;
         !error && entry != end && neighbours.size() < kMostNeighbours; entry.increment(error))
        if (std::error_code ignored; entry->is_directory(ignored))
            neighbours.push_back(entry->path().filename().string());
    const std::string hint = didYouMean(missing.filename().string(), neighbours);
    return fmt::format("there is no folder '{}'; {}", missing.string(),
                       hint.empty() ? fmt::format("make it first: mkdir -p '{}'", directory) : hint);
}

[[noreturn]] void refuse(const std::string& path, const std::string& why) {
    throw Error(ErrorKind::Output, fmt::format("cannot write '{}': {}", path, why), {path});
}

/// True for a link of another user in a folder that everyone can write to, such as /tmp: its target is that
/// user's choice. Linux refuses to follow such links (fs.protected_symlinks), but reading them by hand goes
/// around that.
bool isPlantedLink(const fs::path& link) {
    struct stat own {}, folder {};
    if (::lstat(link.c_str(), &own) != 0 || ::stat(directoryOf(link.string()).c_str(), &folder) != 0)
        return false;
    const bool everyones = (folder.st_mode & S_ISVTX) != 0 && (folder.st_mode & S_IWOTH) != 0;
    return everyones && own.st_uid != ::geteuid() && own.st_uid != folder.st_uid;
}

/// Where a link leads in the end, also when nothing is there yet: std::filesystem takes such a link for a
/// file that is to be made.
std::string targetOf(const std::string& path) {
    constexpr int kMostLinks = 40;  // As many as Linux follows.
    std::error_code ignored;
    fs::path at = path;
    for (int i = 0; fs::is_symlink(at, ignored); ++i) {
        if (i == kMostLinks) refuse(path, "it is a link that leads to itself");
        if (isPlantedLink(at))
            refuse(path, fmt::format("'{}' is a link of another user in a folder that everyone can write to",
                                     at.string()));
        const fs::path next = fs::read_symlink(at, ignored);
        if (ignored) refuse(path, fmt::format("it is a link that cannot be read: {}", ignored.message()));
        at = at.parent_path() / next;  // An absolute target replaces the folder.
    }
    return at.string();
}

constexpr const char* kStandardOutput = "standard output";

}  // namespace

bool isStandardOutput(const std::string& path) { return path == "-" || path.rfind("-.", 0) == 0; }

namespace {

/// A unique name in the folder of a file: the file's name, cut if the result would be too long.
std::string temporaryBeside(const std::string& file, int attempt) {
    constexpr std::size_t kLongestName = 255;
    const std::string end = fmt::format(".{}-{}.tmp", ::getpid(), attempt);
    const std::size_t name = file.rfind('/') + 1;  // 0 without a folder.
    return file.substr(0, std::min(file.size(), name + kLongestName - end.size())) + end;
}

/// The process that temporaryBeside() named `entry` for, if it is a temporary of `name`.
std::optional<pid_t> writerOf(const std::string& entry, const std::string& name) {
    pid_t process = 0;
    int attempt = 0, end = 0;
    if (entry.compare(0, name.size(), name) != 0 ||
        std::sscanf(entry.c_str() + name.size(), ".%d-%d.tmp%n", &process, &attempt, &end) != 2 ||
        end == 0 || name.size() + static_cast<std::size_t>(end) != entry.size())
        return std::nullopt;
    return process;
}

/// True if no process writes to the file: its process has ended, and no machine holds its lock.
bool isAbandoned(const fs::path& file, pid_t process) {
    if (::kill(process, 0) == 0 || errno != ESRCH) return false;
    const int descriptor = ::open(file.c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK);
    if (descriptor < 0) return false;
    const bool free = ::flock(descriptor, LOCK_EX | LOCK_NB) == 0;
    ::close(descriptor);
    return free;
}

/// Removes the temporaries of `file` whose processes were killed. They would stay for ever.
void removeAbandoned(const std::string& file) {
    const std::string name = fs::path(file).filename().string();
    std::error_code error;
    for (fs::directory_iterator entry(directoryOf(file), error), end; !error && entry != end;
         entry.increment(error))
        if (const auto process = writerOf(entry->path().filename().string(), name);
            process && isAbandoned(entry->path(), *process))
            ::unlink(entry->path().c_str());
}

}  // namespace

AtomicFile::AtomicFile(const std::string& path) : path_(path), final_(path) {
    if (path.empty()) throw Error(ErrorKind::Output, "cannot write an output without a file name");
    if (isStandardOutput(path)) {
        openStreamed();
        return;
    }
    std::error_code ignored;
    final_ = targetOf(path);
    // Renaming over these would replace a device node or fail at the very end of a render.
    if (fs::is_directory(final_, ignored)) refuse(path_, "it is a directory");
    if (fs::exists(final_, ignored) && !fs::is_regular_file(final_, ignored))
        refuse(path_, "it is not a regular file");
    // open() rather than mkstemp() so that the file gets the permissions that the user's umask says. The
    // process id alone does not make the name unique: in a container every program may be process 1, and an
    // earlier one may have died here.
    for (int attempt = 0; descriptor_ < 0; ++attempt) {
        temporary_ = temporaryBeside(final_, attempt);
        descriptor_ = ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        const int error_number = errno;
        if (descriptor_ >= 0) ::flock(descriptor_, LOCK_EX | LOCK_NB);  // See removeAbandoned().
        if (descriptor_ >= 0 || error_number == EINTR || (error_number == EEXIST && attempt < 1000))
            continue;
        if (error_number == ENOENT && final_ != path_)
            refuse(path_, fmt::format("it is a link to '{}', whose directory does not exist", final_));
        // Such as /proc, where the kernel makes the files.
        if (error_number == ENOENT && fs::is_directory(directoryOf(final_), ignored))
            refuse(path_, fmt::format("the folder '{}' does not allow new files", directoryOf(final_)));
        if (error_number == ENOENT)
            refuse(path_, fmt::format("the directory '{}' does not exist", directoryOf(final_)));
        fail("cannot write", error_number);
    }
}

AtomicFile::~AtomicFile() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!committed_ && !temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::fail(const char* what, int error_number) const {
    throw Error(ErrorKind::Output, fmt::format("{} '{}': {}", what, path_, std::strerror(error_number)),
                {path_});
}

void AtomicFile::write(const void* bytes, std::size_t size) {
    auto* next = static_cast<const unsigned char*>(bytes);
    while (size > 0) {
        const ssize_t written = ::write(descriptor_, next, size);
        if (written < 0) {
            if (errno == EINTR) continue;
            fail("cannot write", errno);
        }
        next += written;
        size -= static_cast<std::size_t>(written);
    }
}

void AtomicFile::openStreamed() {
    path_ = kStandardOutput;
    std::error_code none;
    const fs::path folder = fs::temp_directory_path(none);
    if (none)
        throw Error(ErrorKind::Output,
                    fmt::format("cannot write to standard output without a "
                                "folder for temporary files (TMPDIR): {}",
                                none.message()));
    temporary_ = temporaryPattern(folder);
    descriptor_ = ::mkstemp(temporary_.data());
    if (descriptor_ >= 0) return;
    const int error_number = errno;
    const std::string wanted = std::exchange(temporary_, {});
    throw Error(ErrorKind::Output,
                fmt::format("cannot write '{}', which is meant for standard output: {}", wanted,
                            std::strerror(error_number)));
}

/// Copies the bytes under the temporary name, written by write() or by a library, to standard output.
void AtomicFile::stream() {
    std::fflush(stdout);
    const int source = ::open(temporary_.c_str(), O_RDONLY | O_CLOEXEC);
    if (source < 0) fail("cannot read what is meant for", errno);
    std::vector<char> buffer(1 << 20);
    int error_number = 0;
    while (error_number == 0) {
        const ssize_t read = ::read(source, buffer.data(), buffer.size());
        if (read < 0 && errno == EINTR) continue;
        if (read < 0) error_number = errno;
        if (read <= 0) break;
        for (ssize_t sent = 0; sent < read && error_number == 0;) {
            const ssize_t now =
                ::write(STDOUT_FILENO, buffer.data() + sent, static_cast<std::size_t>(read - sent));
            if (now >= 0) sent += now;
            if (now < 0 && errno != EINTR) error_number = errno;
        }
    }
    ::close(source);
    if (error_number != 0) fail("cannot write to", error_number);
}

void AtomicFile::commit() {
    if (path_ == kStandardOutput) return stream();
    // Without the sync a power cut after the rename can leave the final name on an empty file.
    while (::fsync(descriptor_) != 0)
        if (errno != EINTR) fail("cannot finish", errno);
    const int descriptor = descriptor_;
    descriptor_ = -1;
    if (::close(descriptor) != 0 && errno != EINTR) fail("cannot finish", errno);
    if (::rename(temporary_.c_str(), final_.c_str()) != 0) fail("cannot finish", errno);
    committed_ = true;
    // The directory entry too; some file systems cannot sync a directory, and the file is good without it.
    const int directory = ::open(directoryOf(final_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (directory >= 0) {
        ::fsync(directory);
        ::close(directory);
    }
}

void checkWritable(const std::string& path) {
    if (isStandardOutput(path)) {
        if (::isatty(STDOUT_FILENO) != 0)
            throw Error(
                ErrorKind::Output,
                fmt::format("'{}' is standard output, which is a terminal "
                            "here; redirect it to a file or a pipe",
                            path));
        return;
    }
    const std::string directory = directoryOf(path);
    std::error_code error;
    if (!fs::exists(directory, error)) refuse(path, missingFolder(directory));
    if (!fs::is_directory(directory, error)) refuse(path, fmt::format("'{}' is not a directory", directory));
    const AtomicFile probe(path);  // Removed again by its destructor.
    removeAbandoned(targetOf(path));
}

void makeOutputFolder(const std::string& path) {
    std::error_code error;
    if (fs::is_directory(path, error)) return;
    const auto cannot = [&path](const std::string& why) {
        throw Error(ErrorKind::Output, fmt::format("cannot make the folder '{}': {}", path, why), {path});
    };
    if (fs::exists(path, error)) cannot("there is a file of this name");
    fs::path folder = fs::path(path).lexically_normal();
    if (!folder.has_filename()) folder = folder.parent_path();
    const std::string above = directoryOf(folder.string());
    if (!fs::exists(above, error)) cannot(missingFolder(above));
    if (!fs::create_directory(folder, error) && error) cannot(error.message());
}

}  // namespace crt
