# emsim in a container: docker build -t emsim . ; docker run --rm -v "$PWD:/decks" emsim deck.cir
FROM python:3.12-slim AS build
RUN apt-get update -qq && apt-get install -y -qq --no-install-recommends build-essential curl ca-certificates \
    && curl -sSf https://sh.rustup.rs | sh -s -- -y -q --profile minimal
ENV PATH=/root/.cargo/bin:$PATH
WORKDIR /source
COPY . .
RUN pip wheel -q --no-deps -w /dist .

FROM python:3.12-slim
COPY --from=build /dist /dist
# pictures too; tables and files of other kinds: emsim[tables,files]
RUN pip install -q --no-cache-dir "$(ls /dist/*.whl)[plot]" && rm -r /dist && useradd --create-home emsim
USER emsim
WORKDIR /decks
ENTRYPOINT ["emsim"]
