# The command zsim in an image:
#   docker build -t zsim .
#   docker run --rm --user "$(id -u):$(id -g)" -v "$PWD:/data" zsim --scene office --out results/office
FROM rust:1.89-bookworm AS build
WORKDIR /zsim
COPY . .
RUN cargo build --release --locked --config profile.release.strip=true

# Distroless images have no version tags. As root, because the folders that clusters mount often belong to it.
# hadolint ignore=DL3007
FROM gcr.io/distroless/cc-debian12:latest
COPY --from=build /zsim/target/release/zsim /usr/local/bin/zsim
COPY --from=build /zsim/LICENSE-APACHE /zsim/LICENSE-MIT /usr/share/doc/zsim/
WORKDIR /data
ENTRYPOINT ["zsim"]
