// Runs a fuzz target over the seeds in the folders that are named, without libFuzzer and with any compiler.
// Every seed must be read to the end: a format that changes makes seeds of the old one worthless, without a
// visible sign.
#include "fuzz_target.h"

#include <fstream>
#include <iterator>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

int main(int argc, char** argv) {
    int seeds = 0, refused = 0;
    for (int i = 1; i < argc; ++i)
        for (const auto& entry : std::filesystem::directory_iterator(argv[i])) {
            std::ifstream file(entry.path(), std::ios::binary);
            const std::string bytes((std::istreambuf_iterator<char>(file)),
                                    std::istreambuf_iterator<char>());
            const int before = crt::fuzz::accepted;
            LLVMFuzzerTestOneInput(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
            ++seeds;
            if (crt::fuzz::accepted > before) continue;
            std::fprintf(stderr, "%s is refused: replace it by one that can be read\n",
                         entry.path().c_str());
            ++refused;
        }
    std::fprintf(stderr, "%d seeds, %d refused\n", seeds, refused);
    return seeds > 0 && refused == 0 ? 0 : 1;
}
