#include "base/code_trust.h"

#include <dirent.h>
#include <dlfcn.h>
#include <fcntl.h>
#include <grp.h>
#include <link.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <vector>

namespace crt::trust {
namespace {

struct Program {
    std::string path;
    struct stat status {};
    bool known = false;
};

/// The file that holds this code: the program crt, libcrt.so in another program, a plugin.
const Program& program() {
    static const Program found = [] {
        Dl_info info{};
        link_map* map = nullptr;
        const bool told = ::dladdr1(reinterpret_cast<void*>(&program), &info, reinterpret_cast<void**>(&map),
                                    RTLD_DL_LINKMAP) != 0;
        // The program has no name in the list of libraries.
        const bool library = told && map != nullptr && map->l_name != nullptr && *map->l_name != '\0';
        Program p;
        char path[PATH_MAX] = {};
        p.known = ::realpath(library ? map->l_name : "/proc/self/exe", path) != nullptr &&
                  ::stat(path, &p.status) == 0;
        if (p.known) p.path = path;
        return p;
    }();
    return found;
}

bool trustedOwner(uid_t owner) {
    return owner == 0 || owner == ::geteuid() || (program().known && owner == program().status.st_uid);
}

/// Room for the texts of one entry of the user or group database.
std::vector<char> room() { return std::vector<char>(std::size_t{1} << 16); }

std::string nameOfUser(uid_t user) {
    std::vector<char> texts = room();
    struct passwd entry {
    }, *found = nullptr;
    if (::getpwuid_r(user, &entry, texts.data(), texts.size(), &found) == 0 && found != nullptr)
        return found->pw_name;
    return std::to_string(user);
}

std::string homeOfUser() {
    std::vector<char> texts = room();
    struct passwd entry {
    }, *found = nullptr;
    if (::getpwuid_r(::geteuid(), &entry, texts.data(), texts.size(), &found) != 0 || found == nullptr)
        return {};
    char path[PATH_MAX];
    return ::realpath(found->pw_dir, path) != nullptr ? path : "";
}

std::string nameOfGroup(gid_t group) {
    std::vector<char> texts = room();
    struct group entry {
    }, *found = nullptr;
    if (::getgrgid_r(group, &entry, texts.data(), texts.size(), &found) == 0 && found != nullptr)
        return found->gr_name;
    return std::to_string(group);
}

/// True if a group has no members but one trusted user: the group of the user's name that systems with "user
/// private groups" make, under which a umask of 002 is harmless.
bool privateGroup(gid_t group) {
    std::vector<char> group_texts = room(), user_texts = room();
    struct group group_entry {
    }, *found_group = nullptr;
    if (::getgrgid_r(group, &group_entry, group_texts.data(), group_texts.size(), &found_group) != 0 ||
        found_group == nullptr)
        return false;
    struct passwd user_entry {
    }, *found_user = nullptr;
    if (::getpwnam_r(found_group->gr_name, &user_entry, user_texts.data(), user_texts.size(), &found_user) !=
            0 ||
        found_user == nullptr)
        return false;
    if (found_user->pw_gid != group || !trustedOwner(found_user->pw_uid)) return false;
    for (char** member = found_group->gr_mem; *member != nullptr; ++member)
        if (std::strcmp(*member, found_user->pw_name) != 0) return false;
    return true;
}

std::string modeText(mode_t mode) {
    char text[8];
    std::snprintf(text, sizeof text, "%04o", static_cast<unsigned>(mode & 07777));
    return text;
}

std::string inQuotationMarks(const std::string& name) { return "'" + name + "'"; }

bool isAbove(const std::string& folder, const std::string& path) {
    return folder == "/" || (path.size() > folder.size() && path.compare(0, folder.size(), folder) == 0 &&
                             path[folder.size()] == '/');
}

std::string folderOf(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    return slash == 0 ? "/" : path.substr(0, slash);
}

}  // namespace

std::string whyNot(const struct stat& status, const std::string& name) {
    const mode_t mode = status.st_mode;
    if (!trustedOwner(status.st_uid))
        return inQuotationMarks(name) + " belongs to another user (" + nameOfUser(status.st_uid) +
               "), who could have replaced it";
    if (S_ISDIR(mode) && (mode & S_ISVTX) != 0) return {};
    const Program& p = program();
    const std::string remedy = " can write to " + inQuotationMarks(name) + " (mode " + modeText(mode) +
                               ") and could have put anything there; chmod go-w " + name;
    if ((mode & S_IWOTH) != 0 && !(p.known && (p.status.st_mode & S_IWOTH) != 0)) return "everyone" + remedy;
    const bool group_of_program =
        p.known && (p.status.st_mode & S_IWGRP) != 0 && p.status.st_gid == status.st_gid;
    if ((mode & S_IWGRP) != 0 && !group_of_program && !privateGroup(status.st_gid))
        return "the group " + nameOfGroup(status.st_gid) + remedy;
    return {};
}

namespace {

std::string cannotBeOpened(const std::string& name, int error) {
    return inQuotationMarks(name) + " cannot be opened: " + std::strerror(error);
}

/// Reason why a folder may not lead to code; empty if it may. `entry`: the path in it that is looked up
/// next.
std::string whyNotIn(const std::string& folder, const std::string& entry, const std::string& home) {
    if (program().known && isAbove(folder, program().path)) return {};
    if (isAbove(folder, home) && (entry == home || isAbove(entry, home))) return {};
    struct stat status {};
    if (::stat(folder.c_str(), &status) != 0)
        return inQuotationMarks(folder) + " cannot be inspected: " + std::strerror(errno);
    return whyNot(status, folder);
}

std::string below(const std::string& folder, const std::string& entry) {
    return folder == "/" ? folder + entry : folder + '/' + entry;
}

/// The file that a name leads to, and why other users could have chosen it, if they could.
Judged follow(const std::string& name) {
    constexpr int kMostLinks = 40;  // As Linux has it.
    std::string rest = name;
    if (name.empty() || name.front() != '/') {
        char here[PATH_MAX];
        if (::getcwd(here, sizeof here) == nullptr) return {{}, cannotBeOpened(name, errno)};
        rest = std::string(here) + "/" + name;
    }
    const std::string home = homeOfUser();
    Judged way{std::string(1, '/'), {}};
    int links = 0;
    while (!rest.empty()) {
        const std::size_t end = std::min(rest.find('/'), rest.size());
        const std::string part = rest.substr(0, end);
        rest.erase(0, end + 1);
        if (part.empty() || part == ".") continue;
        if (part == "..") {
            way.path = folderOf(way.path);
            continue;
        }
        const std::string entry = below(way.path, part);
        if (way.why = whyNotIn(way.path, entry, home); !way.why.empty()) return way;
        struct stat status {};
        if (::lstat(entry.c_str(), &status) != 0) return {{}, cannotBeOpened(name, errno)};
        if (!S_ISLNK(status.st_mode)) {
            way.path = entry;
            continue;
        }
        if (!trustedOwner(status.st_uid))
            return {{},
                    inQuotationMarks(entry) + " is a link of another user (" + nameOfUser(status.st_uid) +
                        "), who could point it anywhere"};
        char target[PATH_MAX];
        const ssize_t length = ::readlink(entry.c_str(), target, sizeof target);
        if (length < 0) return {{}, cannotBeOpened(name, errno)};
        if (++links > kMostLinks) return {{}, cannotBeOpened(name, ELOOP)};
        rest = std::string(target, static_cast<std::size_t>(length)) + "/" + rest;
        if (rest.front() == '/') way.path.assign(1, '/');
    }
    return way;
}

/// Reason why a file at the end of links may not be run; `name`: as messages call it.
std::string whyNotFile(const std::string& path, const std::string& name) {
    // On the descriptor: not blocking, for a pipe waits for who writes to it.
    const int descriptor = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY | O_NOFOLLOW);
    if (descriptor < 0) return cannotBeOpened(name, errno);
    struct stat status {};
    const bool known = ::fstat(descriptor, &status) == 0;
    ::close(descriptor);
    return known && S_ISREG(status.st_mode) ? whyNot(status, name)
                                            : inQuotationMarks(name) + " is not a regular file";
}

struct CloseFolder {
    void operator()(DIR* folder) const { ::closedir(folder); }
};

/// The first reason within a folder; empty if there is none.
std::string whyNotWithin(const std::string& path) {
    struct stat status {};
    if (::lstat(path.c_str(), &status) != 0) return cannotBeOpened(path, errno);
    if (S_ISREG(status.st_mode)) return whyNotFile(path, path);
    if (S_ISLNK(status.st_mode)) return judge(path).why;
    if (!S_ISDIR(status.st_mode)) return inQuotationMarks(path) + " is neither a file nor a folder";
    if (std::string why = whyNot(status, path); !why.empty()) return why;
    const std::unique_ptr<DIR, CloseFolder> folder(::opendir(path.c_str()));
    if (!folder) return cannotBeOpened(path, errno);
    while (const dirent* const entry = ::readdir(folder.get())) {
        const std::string name = entry->d_name;
        if (name == "." || name == "..") continue;
        if (std::string why = whyNotWithin(below(path, name)); !why.empty()) return why;
    }
    return {};
}

}  // namespace

Judged judge(const std::string& name) {
    Judged found = follow(name);
    if (found.why.empty()) found.why = whyNotFile(found.path, name);
    return found;
}

Judged judgeTree(const std::string& name) {
    Judged found = follow(name);
    if (found.why.empty()) found.why = whyNotWithin(found.path);
    return found;
}

std::string whyNotFolder(const std::string& name) {
    const Judged found = follow(name);
    return found.why.empty() ? whyNotIn(found.path, {}, homeOfUser()) : found.why;
}

}  // namespace crt::trust
