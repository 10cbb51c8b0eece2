#include "cuda_compile_process.h"

#include "cuda_lean_kernel.h"

namespace crt::cuda {

plugin::CompileMessage messageOf(const CompileJob& job) {
    plugin::CompileMessage message;
    message.add(job.nvrtc_path);
    message.add(job.text);
    message.addNumber(job.arch);
    message.addNumber(job.spec.entry);
    message.addNumber(job.spec.features);
    return message;
}

std::string compileProgram() {
    return plugin::programBeside(reinterpret_cast<const void*>(&compileProgram), "crt_nvrtc");
}

std::vector<unsigned char> compileJob(plugin::CompileMessage& message) {
    CompileJob job;
    job.nvrtc_path = message.nextText();
    job.text = message.nextText();
    job.arch = message.nextNumber<int>();
    job.spec.entry = message.nextNumber<Entry>();
    job.spec.features = message.nextNumber<std::uint64_t>();
    return compileLean(Nvrtc::open({job.nvrtc_path}), job.text, job.arch, job.spec).bytes;
}

}  // namespace crt::cuda
