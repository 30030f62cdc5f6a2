# SPDX-License-Identifier: Apache-2.0
"""The bill of materials of a release: tetap.spdx.json, SPDX 2.3 (https://spdx.github.io/spdx-spec/v2.3/)."""
import hashlib
import json
import os
import re
import subprocess
import time

# Debian package, its licence, what it is to which artefacts, and how an artefact that has it ends. Licences as /usr/share/doc/PACKAGE/copyright states them.
PARTS = (("libeigen3-dev", "MPL-2.0", "CONTAINS", (".elf", ".bin", ".hex", "_amd64.deb", "_arm64.deb", ".html")),
         ("libnewlib-arm-none-eabi", "BSD-3-Clause", "STATIC_LINK", (".elf", ".bin", ".hex")),
         ("gcc-arm-none-eabi", "GPL-3.0-or-later WITH GCC-exception-3.1", "STATIC_LINK", (".elf", ".bin", ".hex")),
         ("libstdc++6", "GPL-3.0-or-later WITH GCC-exception-3.1", "DYNAMIC_LINK", ("_amd64.deb", "_arm64.deb")),
         ("libgcc-s1", "GPL-3.0-or-later WITH GCC-exception-3.1", "DYNAMIC_LINK", ("_amd64.deb", "_arm64.deb")),
         ("libc6", "LGPL-2.1-or-later", "DYNAMIC_LINK", ("_amd64.deb", "_arm64.deb")),
         ("wasi-libc", "Apache-2.0 WITH LLVM-exception", "STATIC_LINK", (".html",)),
         ("libc++-14-dev-wasm32", "Apache-2.0 WITH LLVM-exception", "STATIC_LINK", (".html",)))
TYPES = {".elf": "BINARY", ".bin": "BINARY", ".hex": "BINARY", ".deb": "ARCHIVE", ".gz": "ARCHIVE", ".html": "APPLICATION"}


def identifier(kind, name):
    return f"SPDXRef-{kind}-" + re.sub(r"[^A-Za-z0-9.-]", "-", name.replace("++", "pp"))


def installed(package):
    done = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", package], capture_output=True, text=True, check=False)
    return done.stdout if done.returncode == 0 else None


def file_of(path, name):
    with open(path, "rb") as file:
        data = file.read()
    return {"SPDXID": identifier("File", name), "fileName": "./" + name, "fileTypes": [TYPES.get(os.path.splitext(name)[1], "TEXT")],
            "checksums": [{"algorithm": "SHA1", "checksumValue": hashlib.sha1(data).hexdigest()}, {"algorithm": "SHA256", "checksumValue": hashlib.sha256(data).hexdigest()}],
            "licenseConcluded": "NOASSERTION", "licenseInfoInFiles": ["NOASSERTION"], "copyrightText": "NOASSERTION"}


def package_of(name, version, licence, place, supplier):
    return {"SPDXID": identifier("Package", name), "name": name, "versionInfo": version, "downloadLocation": place, "filesAnalyzed": False, "supplier": supplier,
            "licenseConcluded": licence, "licenseDeclared": licence, "copyrightText": "NOASSERTION"}


def of_the_page(root):
    """uPlot, which sim_host/page/vendor has."""
    with open(os.path.join(root, "sim_host/page/vendor/uplot/uPlot.iife.min.js"), encoding="utf-8") as file:
        place, version = re.search(r"(https://\S+) \(v([\d.]+)\)", file.read(200)).groups()
    return package_of("uPlot", version, "MIT", place, "NOASSERTION")


def write(release):
    names = sorted(os.path.relpath(os.path.join(where, name), release.folder) for where, _, files in os.walk(release.folder) for name in files)
    files = [file_of(release.path(name), name) for name in names]
    whole = hashlib.sha256("".join(one["checksums"][1]["checksumValue"] for one in files).encode()).hexdigest()
    own = package_of("tetap", release.version, "Apache-2.0", "NOASSERTION", "NOASSERTION")
    own.update(primaryPackagePurpose="FIRMWARE", sourceInfo=f"built from commit {release.commit}")
    relations = [("SPDXRef-DOCUMENT", "DESCRIBES", own["SPDXID"])] + [(own["SPDXID"], "CONTAINS", one["SPDXID"]) for one in files]
    packages = [own]
    for package, licence, relation, endings in PARTS:
        users, version = [one for one in files if one["fileName"].endswith(endings)], installed(package)
        if users and version:
            part = package_of(package, version, licence, "NOASSERTION", "Organization: Debian")
            part["externalRefs"] = [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": f"pkg:deb/debian/{package}@{version}".replace("++", "%2B%2B")}]
            packages.append(part)
            relations += [(one["SPDXID"], relation, part["SPDXID"]) for one in users]
    if pages := [one for one in files if one["fileName"].endswith(".html")]:
        packages.append(of_the_page(release.root))
        relations += [(one["SPDXID"], "CONTAINS", packages[-1]["SPDXID"]) for one in pages]
    document = {"spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": f"tetap-{release.version}",
                "documentNamespace": f"https://spdx.org/spdxdocs/tetap-{release.version}-{whole[:32]}",
                "creationInfo": {"created": time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(release.epoch)), "creators": ["Tool: tetap-make_release"]},
                "packages": packages, "files": files,
                "relationships": [{"spdxElementId": begin, "relationshipType": kind, "relatedSpdxElement": end} for begin, kind, end in relations]}
    with open(release.path("tetap.spdx.json"), "w", encoding="utf-8") as file:
        json.dump(document, file, indent=1)
        file.write("\n")
