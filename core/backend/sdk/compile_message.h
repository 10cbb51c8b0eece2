/// The words between a backend and its compiler process (compile_process.h).
#pragma once

#include <cstddef>
#include <cstring>
#include <stdexcept>
#include <string>
#include <vector>

namespace crt::plugin {

/// A row of byte strings.
class CompileMessage {
public:
    void add(const void* bytes, std::size_t size);
    void add(const std::string& text) { add(text.data(), text.size()); }
    template <class Number>
    void addNumber(Number number) {
        add(&number, sizeof number);
    }

    /// Each takes the next one. Throws std::runtime_error where it is missing or of another size.
    std::vector<unsigned char> next();
    std::string nextText();
    template <class Number>
    Number nextNumber() {
        const std::vector<unsigned char> bytes = next();
        Number number{};
        if (bytes.size() != sizeof number)
            throw std::runtime_error("the compiler process has another version");
        std::memcpy(&number, bytes.data(), sizeof number);
        return number;
    }

    /// Through a file descriptor; throws std::runtime_error.
    void writeTo(int descriptor) const;
    /// The message that a file holds from its beginning.
    static CompileMessage readFrom(int descriptor);

private:
    std::vector<unsigned char> bytes_;
    std::size_t taken_ = 0;
};

}  // namespace crt::plugin
