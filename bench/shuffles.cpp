// Finds the masks of core/kernel/sampling/shuffles.h, and prints that file (in two minutes).
//
// Each pair of Sobol numbers of a sample is a point of a (0,2)-sequence, whose index is first shuffled by a
// matrix over GF(2): index ^= (index >> s) & mask[s] for s = 1 … 8. All such matrices keep the pair a
// (0,2)-sequence. They differ in how well two pairs together, four numbers, fill their cube. The
// search goes through the bits of the index, and for each bit through the dimensions. It tries all masks
// that concern this bit, and keeps those with the least figure of merit beside the dimensions before.
//
// The figure is the variance of an Owen-scrambled net (Owen 1997, "Monte Carlo variance of scrambled net
// quadrature") of a function whose variance falls by 2^kBeta from digit to digit: a sum over the vectors of
// the dual net that involve two numbers or more.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "kernel/sampling/sampler.h"

namespace {

using u32 = std::uint32_t;

constexpr unsigned kVertices = 4;
constexpr unsigned kSteps = 8;     // a row of masks
constexpr unsigned kJudged = 18;   // bits of the index; masks of those above are random
constexpr unsigned kDigits = 6;    // of each number
constexpr double kBeta = 1.0;

using Masks = std::array<u32, kSteps>;

// Rows are digits of a number, the most significant first; bits of a row are bits of the index.
struct Matrix {
    std::array<u32, 32> row{};
};

u32 shuffled(u32 index, const Masks& masks) {
    for (unsigned s = 0; s < kSteps; ++s) index ^= (index >> (s + 1)) & masks[s];
    return index;
}

// The second number of a pair: Pascal's matrix times the first's.
Matrix second(const Matrix& first) {
    Matrix m;
    for (u32 r = 0; r < 32; ++r)
        for (u32 j = r; j < 32; ++j)
            if ((j & r) == r) m.row[r] ^= first.row[j];
    return m;
}

// Rows in echelon form.
struct Basis {
    std::array<u32, 32> with_top{};
    unsigned rank = 0;

    void add(u32 row) {
        while (row != 0) {
            u32& same = with_top[31 - static_cast<unsigned>(__builtin_clz(row))];
            if (same == 0) {
                same = row;
                ++rank;
                return;
            }
            row ^= same;
        }
    }
};

// Vectors of the dual net of 2^bits points of the numbers with these matrices.
class Merit {
public:
    Merit(std::vector<const Matrix*> numbers, unsigned bits) : numbers_(std::move(numbers)), bits_(bits) {
        std::size_t size = 1;
        for (std::size_t i = 0; i < numbers_.size(); ++i) size *= kDigits + 1;
        counts_.assign(size, 0.0);
        count(0, 0, Basis{}, 0);
    }

    // Of those whose first digits that are not 0 are the k-th of each number: differences along each axis.
    double value() {
        std::size_t stride = 1;
        for (std::size_t axis = 0; axis < numbers_.size(); ++axis, stride *= kDigits + 1)
            for (std::size_t i = counts_.size(); i-- > 0;)
                if (i / stride % (kDigits + 1) != 0) counts_[i] -= counts_[i - stride];
        double sum = 0;
        for (std::size_t i = 1; i < counts_.size(); ++i) {
            unsigned digits = 0, involved = 0;
            for (std::size_t left = i; left != 0; left /= kDigits + 1) {
                digits += static_cast<unsigned>(left % (kDigits + 1));
                involved += left % (kDigits + 1) != 0 ? 1 : 0;
            }
            if (involved >= 2 && digits <= bits_ + 3) sum += counts_[i] * std::exp2(-(1 + kBeta) * digits);
        }
        return sum * std::exp2(kBeta * bits_);
    }

private:
    // All vectors within the first digits of each number: 2^(rows - rank).
    void count(std::size_t number, std::size_t place, const Basis& before, unsigned rows) {
        if (number == numbers_.size()) {
            counts_[place] = std::exp2(static_cast<double>(rows - before.rank));
            return;
        }
        Basis basis = before;
        for (unsigned k = 0; k <= kDigits; ++k) {
            if (k > 0) basis.add(numbers_[number]->row[k - 1] & ((1u << bits_) - 1));
            count(number + 1, place * (kDigits + 1) + k, basis, rows + k);
        }
    }

    std::vector<const Matrix*> numbers_;
    unsigned bits_;
    std::vector<double> counts_;
};

enum class Use { Film, Wavelength, Lens, Hero, Light, LightChoice, Bsdf, Choice, Mix, Roulette, Spare };

struct Dimension {
    u32 number;  // CRT_DIM_…
    Use use;
    int vertex;  // -1: of the camera
    Masks masks{};
    Matrix x{}, y{};
};

// The share of the light that depends on the numbers of both, relative to other pairs.
double weight(const Dimension& earlier, const Dimension& later) {
    const double far = std::pow(0.6, std::max(later.vertex, 0));
    const bool is_direction = later.use == Use::Light || later.use == Use::Bsdf;
    if (earlier.use == Use::Film) return (is_direction || later.use == Use::Lens ? 1.0 : 0.5) * far;
    if (earlier.vertex < 0 || later.vertex < 0) return 0.5 * far;
    if (earlier.vertex == later.vertex) {
        if (earlier.use == Use::Light && later.use == Use::LightChoice) return 2 * far;
        if (earlier.use == Use::Bsdf && later.use == Use::Choice) return 2 * far;
        return (later.use == Use::Mix ? 0.7 : 0.25) * far;
    }
    const double apart = std::pow(0.6, later.vertex - earlier.vertex - 1) * far;
    if (earlier.use == Use::Bsdf) return (is_direction ? 1.5 : 0.7) * apart;
    if (earlier.use == Use::Choice || earlier.use == Use::Mix) return 0.5 * apart;
    // The light of one vertex is added to that of the next. Still the two must not be worse than chance.
    return 0.1 * apart;
}

// In the order of the search: what comes first has the better masks.
std::vector<Dimension> dimensions() {
    std::vector<Dimension> all{{CRT_DIM_FILM, Use::Film, -1, {}, {}, {}},
                               {CRT_DIM_WAVELENGTH, Use::Wavelength, -1, {}, {}, {}}};
    for (unsigned vertex = 0; vertex < kVertices; ++vertex) {
        const auto add = [&](u32 number, Use use) {
            const u32 base = crt::kernel::crt_vertex_dimension(vertex);
            all.push_back({base + number, use, static_cast<int>(vertex), {}, {}, {}});
        };
        add(CRT_DIM_LIGHT, Use::Light);
        add(CRT_DIM_LIGHT_CHOICE, Use::LightChoice);
        add(CRT_DIM_BSDF, Use::Bsdf);
        add(CRT_DIM_CHOICE, Use::Choice);
        add(CRT_DIM_MIX, Use::Mix);
        add(CRT_DIM_ROULETTE, Use::Roulette);
        if (vertex == 0) {
            all.push_back({CRT_DIM_LENS, Use::Lens, -1, {}, {}, {}});
            all.push_back({CRT_DIM_HERO, Use::Hero, -1, {}, {}, {}});
        }
        for (const u32 spare : {5u, 6u}) add(spare, Use::Spare);
    }
    return all;
}

void setColumn(Dimension& d, unsigned bit, const Masks& masks) {
    const u32 column = shuffled(1u << bit, masks);
    d.masks = masks;
    for (unsigned r = 0; r <= bit; ++r) d.x.row[r] |= (column >> r & 1u) << bit;
    d.y = second(d.x);
}

// `d` with the masks that concern this bit of the index chosen by the bits of `choice`.
Dimension withColumn(Dimension d, unsigned bit, unsigned choice) {
    Masks masks = d.masks;
    for (unsigned s = 0; s < kSteps && s < bit; ++s) masks[s] |= (choice >> s & 1u) << (bit - s - 1);
    setColumn(d, bit, masks);
    return d;
}

double merit(const Dimension& d, const std::vector<Dimension>& all, unsigned bits, double most) {
    double sum = 0;
    for (const Dimension& other : all) {
        if (other.number == d.number || sum >= most) break;
        sum += weight(other, d) * Merit({&other.x, &other.y, &d.x, &d.y}, bits).value();
    }
    return sum;
}

void chooseColumn(std::vector<Dimension>& all, Dimension& d, unsigned bit, std::mt19937& random) {
    const unsigned choices = 1u << std::min(bit, kSteps);
    if (d.use == Use::Film) {
        d = withColumn(d, bit, 0);  // the index as it is
        return;
    }
    if (bit >= kJudged) {
        d = withColumn(d, bit, random() & (choices - 1));
        return;
    }
    Dimension best;
    double least = HUGE_VAL;
    for (unsigned choice = 0; choice < choices; ++choice) {
        const Dimension tried = withColumn(d, bit, choice);
        const double m = merit(tried, all, bit + 1, least);
        if (m < least) {
            least = m;
            best = tried;
        }
    }
    d = best;
}

}  // namespace

int main() {
    std::vector<Dimension> all = dimensions();
    std::mt19937 random(1);
    for (unsigned bit = 0; bit < 32; ++bit)
        for (Dimension& d : all) chooseColumn(all, d, bit, random);
    std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
    std::puts(
        "/*\n"
        " * shuffles.h: for each of the first dimensions of a path, the eight masks by which\n"
        " * crt_shuffled_index shuffles the index of a Sobol point. bench/shuffles.cpp finds them, and\n"
        " * prints this file.\n"
        " */\n"
        "#ifndef CRT_SHUFFLES_H\n"
        "#define CRT_SHUFFLES_H\n\n"
        "#include \"kernel/dialect/dialect.h\"\n\n"
        "CRT_KERNEL_BEGIN\n");
    std::printf("#define CRT_SHUFFLE_STEPS %uu\n", kSteps);
    std::printf("#define CRT_SHUFFLED_DIMENSIONS %zuu\n\n", all.size());
    std::puts("CRT_CONSTANT u32 crt_shuffles[CRT_SHUFFLED_DIMENSIONS * CRT_SHUFFLE_STEPS] = {");
    for (const Dimension& d : all) {
        std::printf("   ");
        for (const u32 mask : d.masks) std::printf(" 0x%08xu,", mask);
        std::puts("");
    }
    std::puts("};\n\nCRT_KERNEL_END\n\n#endif");
}
