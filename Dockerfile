# ForeReach in a container, from the packages that scripts/package makes:
#   scripts/package && docker build -t forereach . && docker run --rm -v "$PWD/run:/run/forereach/run" forereach
FROM debian:12-slim
COPY build/packages/forereach_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/forereach_*.deb && \
    rm -rf /tmp/*.deb /var/lib/apt/lists/*
WORKDIR /run/forereach
ENTRYPOINT ["forereach"]
CMD ["demo", "--bus", "memq"]
