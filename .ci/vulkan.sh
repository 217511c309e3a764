#!/usr/bin/env bash
# Sourced by `run`: Mesa's Vulkan on the CPU with ray tracing (lavapipe, 25.0 or later) and the validation layers, from the
# distribution's backports; the pinned shader compiler from its Python wheel. What is there already is left as it is. Without
# root and without them the Vulkan tests say that they were skipped; on the server they have to run.

lavapipe() { ls /usr/share/vulkan/icd.d/lvp_icd*.json 2> /dev/null | head -1; }
has_lavapipe() {
  [ -n "$(lavapipe)" ] && dpkg --compare-versions "$(dpkg-query -W -f '${Version}' mesa-vulkan-drivers 2> /dev/null)" ge 25
}

if ! has_lavapipe && [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
  # The mirror that the machine uses has the backports as well.
  mirror="$(cat /etc/apt/sources.list /etc/apt/sources.list.d/debian.sources 2> /dev/null \
    | sed -nE 's/^(URIs:|deb) +(\[[^]]*\] +)?([a-z+]+:[^ ]*).*/\3/p' | grep -v security | head -1)"
  suite="$(. /etc/os-release && echo "$VERSION_CODENAME")-backports"
  echo "deb $mirror $suite main" > /etc/apt/sources.list.d/backports.list
  apt-get -qq update
  export DEBIAN_FRONTEND=noninteractive
  apt-get -qq install -y --no-install-recommends -t "$suite" mesa-vulkan-drivers > /dev/null
  apt-get -qq install -y --no-install-recommends libvulkan1 vulkan-validationlayers > /dev/null
fi
if has_lavapipe; then
  VK_DRIVER_FILES="$(lavapipe)"
  export VK_DRIVER_FILES ORTHANT_REQUIRE_VULKAN=1
else
  echo "lavapipe is not installed: the Vulkan tests are skipped"
  test "${CI:-}" != 1
fi

if [ -z "${ORTHANT_SLANGC:-}" ]; then
  slang="${XDG_CACHE_HOME:-${HOME:-$PWD/target}/.cache}/orthant/slangtorch-1.3.22"
  if [ ! -x "$slang/slangtorch/bin/slangc" ]; then
    if ! python3 -m pip --version > /dev/null 2>&1 && [ "$(id -u)" = 0 ] && command -v apt-get > /dev/null; then
      apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y python3-pip > /dev/null
    fi
    mkdir -p "$slang"
    (cd "$slang" && python3 -m pip download --quiet --no-deps slangtorch==1.3.22 \
      && python3 -c 'import glob, zipfile; zipfile.ZipFile(glob.glob("slangtorch*.whl")[0]).extractall()' \
      && chmod +x slangtorch/bin/slangc) || echo "the shader compiler could not be fetched"
  fi
  if [ -x "$slang/slangtorch/bin/slangc" ]; then
    export ORTHANT_SLANGC="$slang/slangtorch/bin/slangc" ORTHANT_REQUIRE_SLANGC=1
  else
    echo "slangc is not there: the shaders are not compiled again"
    test "${CI:-}" != 1
  fi
fi
