# crt on Debian 12, with its CUDA, Embree and OpenCL backends. NVIDIA's driver comes from the host, by the
# NVIDIA Container Toolkit; without a GPU crt runs on the processor.
#
#   docker build -t crt .
#   docker run --rm --gpus all -v "$PWD:/work" crt scene.yaml -o scene.exr
#   docker run --rm -v "$PWD:/work" crt /usr/share/crt/configs/cornell_box.yaml -o cornell_box.png
FROM debian:12 AS build
WORKDIR /src
COPY . .
RUN apt-get update && apt-get install -y --no-install-recommends ca-certificates dpkg-dev
RUN scripts/build -DCRT_TESTS=OFF -DCRT_CUDA_ARCHITECTURES=all-major
RUN cd build/release && cpack -G DEB -B /package
# The run-time compiler of lean kernels: with it they are made for the scene, without it a precompiled one
# serves.
RUN mkdir /nvrtc && cp -L .cache/cuda/toolkit/lib64/libnvrtc*.so* /nvrtc/

FROM debian:12-slim
COPY --from=build /package/*.deb /tmp/
RUN apt-get update \
    && apt-get install -y --no-install-recommends /tmp/*.deb pocl-opencl-icd \
    && rm -rf /var/lib/apt/lists/* /tmp/*.deb
COPY --from=build /nvrtc/ /usr/local/cuda/lib64/
ENV CUDA_HOME=/usr/local/cuda NVIDIA_VISIBLE_DEVICES=all NVIDIA_DRIVER_CAPABILITIES=compute,utility
WORKDIR /work
ENTRYPOINT ["crt"]
