# SPDX-License-Identifier: Apache-2.0
"""Debian packages by dpkg-deb: control, copyright, changelog, manual pages."""
import email.utils
import gzip
import os
import re
import subprocess
import tempfile
import time

COPYRIGHT = """Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: tetap

Files: *
Copyright: {year} the tetap authors
License: Apache-2.0
Comment: The programs contain templates of Eigen, https://eigen.tuxfamily.org, under the
 Mozilla Public License, version 2.0.
 On Debian systems the text of the Apache License, version 2.0, is in
 /usr/share/common-licenses/Apache-2.0.
"""


def said_by(*command, **more):
    return subprocess.run(command, capture_output=True, text=True, check=True, **more).stdout


def architecture():
    return said_by("dpkg", "--print-architecture").strip()


def libraries(files):
    """Depends of programs, with the versions that their symbols need."""
    with tempfile.TemporaryDirectory() as folder:
        os.makedirs(os.path.join(folder, "debian"))
        with open(os.path.join(folder, "debian/control"), "w", encoding="utf-8") as file:
            file.write("Source: tetap\n\nPackage: tetap\nArchitecture: any\n")
        text = said_by("dpkg-shlibdeps", "-O", *(f"-e{name}" for name in files), cwd=folder)
    return re.search(r"^shlibs:Depends=(.*)$", text, re.M)[1]


def compressed(path, text, epoch):
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as raw, gzip.GzipFile("", "wb", 9, raw, mtime=epoch) as file:
        file.write(text.encode())


def manual(path, name, help_text, version, epoch):
    """A page of section 1 from what --help prints: its first lines are the usage, the next the description."""
    usage, _, rest = help_text.partition("\n\n")
    what = re.split(r"(?<=[.;]) |\n\n", rest.strip().replace("\n", " ", 1))[0].strip().rstrip(".")

    def escaped(text):
        lines = text.replace("\\", "\\e").replace("-", "\\-").splitlines()
        return "\n".join("\\&" + line if line[:1] in (".", "'") else line for line in lines)

    date = time.strftime("%Y-%m-%d", time.gmtime(epoch))
    compressed(path, f""".TH {name.upper()} 1 {date} "tetap {version}" "User Commands"
.SH NAME
{escaped(name)} \\- {escaped(what[:1].lower() + what[1:])}
.SH SYNOPSIS
.nf
{escaped(usage.removeprefix("usage: "))}
.fi
.SH DESCRIPTION
.nf
{escaped(rest.rstrip())}
.fi
""", epoch)


def package(release, stage, name, architecture_of_it, depends, title, text):
    """NAME_VERSION_ARCHITECTURE.deb of what lies in the stage."""
    documents = os.path.join(stage, "usr/share/doc", name)
    os.makedirs(documents)
    with open(os.path.join(documents, "copyright"), "w", encoding="utf-8") as file:
        file.write(COPYRIGHT.format(year=time.gmtime(release.epoch).tm_year))
    maintainer = release.options.maintainer
    compressed(os.path.join(documents, "changelog.gz"), f"tetap ({release.version}) unstable; urgency=medium\n\n  * Built from commit {release.commit[:12]}; CHANGELOG.md has the changes.\n\n"
               f" -- {maintainer}  {email.utils.formatdate(release.epoch)}\n", release.epoch)
    size_kib = 0
    for where, folders, names in os.walk(stage):
        os.chmod(where, 0o755)
        size_kib += len(folders) + sum(-(-os.lstat(os.path.join(where, one)).st_size // 1024) for one in names)
    os.makedirs(os.path.join(stage, "DEBIAN"))
    with open(os.path.join(stage, "DEBIAN/control"), "w", encoding="utf-8") as file:
        file.write(f"Package: {name}\nSource: tetap\nVersion: {release.version}\nArchitecture: {architecture_of_it}\nMaintainer: {maintainer}\nInstalled-Size: {size_kib}\nDepends: {depends}\n"
                   f"Section: {'libdevel' if name.endswith('-dev') else 'science'}\nPriority: optional\nDescription: {title}\n" + "".join(f" {line}\n" for line in text.splitlines()))
    sums = []
    for where, folders, names in os.walk(stage):
        folders.sort()
        for one in sorted(names):
            path = os.path.join(where, one)
            if not os.path.islink(path) and not where.endswith("/DEBIAN"):
                sums.append(f"{said_by('md5sum', path).split()[0]}  {os.path.relpath(path, stage)}\n")
    with open(os.path.join(stage, "DEBIAN/md5sums"), "w", encoding="utf-8") as file:
        file.writelines(sums)
    for where, folders, names in os.walk(stage):  # dpkg-deb clamps times that are later than $SOURCE_DATE_EPOCH, and keeps earlier ones
        for one in [*folders, *names]:
            os.utime(os.path.join(where, one), (release.epoch, release.epoch), follow_symlinks=False)
    os.utime(stage, (release.epoch, release.epoch))
    said_by("dpkg-deb", "--root-owner-group", "-Zxz", "--build", stage, release.path(f"{name}_{release.version}_{architecture_of_it}.deb"))
