# Images with the program: `docker build -t ntp .` has all of it, and
# `docker build --target worker -t ntp-worker .` what a cluster's nodes need. docs/build.md tells which is for whom.
# The C and C++ compilers are in the image of Rust; with nasm H.264 is encoded faster, into the same bytes.
FROM rust:1.95-bookworm AS source
RUN apt-get update && apt-get install -y --no-install-recommends nasm && rm -rf /var/lib/apt/lists/*
WORKDIR /src
COPY . .

FROM source AS build-worker
RUN cargo build --release --locked --no-default-features && strip target/release/ntp

FROM source AS build
RUN cargo build --release --locked && strip target/release/ntp

# The program needs glibc and libstdc++, which the smallest image of Debian has.
FROM debian:bookworm-slim AS worker
COPY --from=build-worker /src/target/release/ntp /usr/local/bin/ntp
WORKDIR /data
ENTRYPOINT ["ntp"]

FROM debian:bookworm-slim AS full
COPY --from=build /src/target/release/ntp /usr/local/bin/ntp
COPY pipelines /usr/local/share/ntp/pipelines
WORKDIR /data
ENTRYPOINT ["ntp"]
