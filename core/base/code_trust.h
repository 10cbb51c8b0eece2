/// Decides whether a file may be run as code (plugins, compiled kernels, kernel texts): not if a user
/// without control over this program could have written it. The rules are OpenSSH's for its configuration,
/// with one addition (docs/decisions/0014): the owner and the writers of the program itself are trusted,
/// because who can change the program needs no plugin. The program is the file that holds this code: crt, or
/// libcrt.so in a program of another owner.
///
/// Uses nothing of the core: it is part of crt::kernel_cache too.
#pragma once

#include <string>

struct stat;

namespace crt::trust {

/// Other users who can write to an open file or folder, as a sentence about `name` with a remedy; empty if
/// there are none. It belongs to this user, to root or to the program's owner, and neither everyone nor a
/// group of other people can write to it. A folder with the sticky bit, as /tmp has, may be writable by
/// everyone, because there no user can rename or remove another user's files. [any thread]
std::string whyNot(const struct stat& status, const std::string& name);

/// A name that was resolved once. Callers open `path`, never the name again.
struct Judged {
    std::string path;  ///< Without links; of use where `why` is empty.
    std::string why;   ///< Reason why it may not be run, as a sentence; empty if it may.
};

/// The same for code that is opened by its name later, as dlopen() does. Resolves the name as the system
/// does, and checks each folder on the way, those of links too. Each link must have an owner that whyNot()
/// trusts, and the target must be a regular file. So no other user can make the path lead to another file
/// later. Folders on the way to the program itself, and above the user's home, are not checked. A file whose
/// status cannot be read gives its reason. [any thread]
Judged judge(const std::string& name);

/// The same for a folder of programs: it, and all files and folders below it. [any thread]
Judged judgeTree(const std::string& name);

/// The same for a folder that will hold code. [any thread]
std::string whyNotFolder(const std::string& name);

}  // namespace crt::trust
