/// Whether a file may be run as code (plugins, compiled kernels, kernel texts): not if somebody could have
/// written it who may not decide what this program does. The rules are OpenSSH's for its configuration, with
/// one addition (docs/decisions/0014): the owner and the writers of the program itself are trusted, because
/// who can change the program needs no plugin. The program is the file that holds this code: crt, or
/// libcrt.so in a program of another owner.
///
/// Uses nothing of the core: it is part of crt::kernel_cache too.
#pragma once

#include <string>

struct stat;

namespace crt::trust {

/// Who else can write to an open file or folder, as a sentence about `name` with what to do about it; empty
/// when nobody. It belongs to this user, to root or to the program's owner, and neither everyone nor a group
/// of other people can write to it. A folder with the sticky bit, as /tmp has, may be written to by
/// everyone: there nobody can rename or remove what is another's. [any thread]
std::string whyNot(const struct stat& status, const std::string& name);

/// A name that was followed once. What is opened is `path`, never the name again.
struct Judged {
    std::string path;  ///< Without links; of use where `why` is empty.
    std::string why;   ///< Why it may not be run, as a sentence; empty if it may.
};

/// The same for code that is opened by its name later, as dlopen() does. The name is followed as the system
/// follows it. Each folder in which a part of it is looked up is asked, those that links lie in too; a link
/// belongs to somebody whom whyNot() trusts; and what is found is a regular file. So nobody else can make
/// the path mean another file later. Folders on the way to the program itself, and above the user's home,
/// are not asked. A file that cannot be looked at gives its reason. [any thread]
Judged judge(const std::string& name);

/// The same for a folder of programs: it, and all files and folders below it. [any thread]
Judged judgeTree(const std::string& name);

/// The same for a folder that will hold code. [any thread]
std::string whyNotFolder(const std::string& name);

}  // namespace crt::trust
