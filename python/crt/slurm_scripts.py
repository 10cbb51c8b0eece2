"""The scripts that `crt slurm` writes."""

import shlex

RENDER = r"""#!/bin/bash
#SBATCH --ntasks=1
#SBATCH --nodes=1
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --signal=B:USR1@60
# A part of a render, number SLURM_ARRAY_TASK_ID. It may be stopped, killed and started again: it goes on
# from the film that it has saved. Written by crt slurm; submit.sh submits it.
set -u
crt={crt}
parts={parts}
ranges=({ranges})
part=$SLURM_ARRAY_TASK_ID
first=${{ranges[$part]%:*}}
end=${{ranges[$part]#*:}}
film=$parts/$part.crtfilm
whole=$parts/$part.whole.crtfilm

done_until() {{  # The end of the samples that the film has. They begin with the part's first.
    "$crt" info "$film" | sed -n 's/^  samples .* per pixel: [0-9]*-\([0-9]*\)$/\1/p'
}}

if [[ -e $whole ]]; then
    echo "part $part is done"
    exit 0
fi
from=$first
if [[ -e $film ]]; then
    from=$(done_until)
    if [[ -z $from ]]; then
        echo "crt slurm: error: '$film' does not hold the first samples of part $part; remove it" >&2
        exit 2
    fi
fi

requeue=0 signalled=0 child=
stop() {{ signalled=1; if [[ -n $child ]]; then kill -TERM "$child" 2>/dev/null; fi; }}
trap stop TERM INT
trap 'requeue=1; stop' USR1  # The time of the job is nearly over.

code=0
if ((from < end)); then
    "$crt" render {scene} {options} --samples "$from:$end" -o "$film" --resume \
        --checkpoint-every {every} --report none &
    child=$!
    wait "$child"
    code=$?
    while ((signalled)); do  # A signal ends `wait`, not the program.
        signalled=0
        wait "$child"
        code=$?
    done
fi
if ((code == 0)); then
    mv -- "$film" "$whole"
    rm -f -- "$film".*.tmp  # Of programs that were killed.
elif ((requeue)) && [[ -e $film ]] && (($(done_until) > from)); then
    scontrol requeue "$SLURM_JOB_ID"
fi
exit "$code"
"""

MERGE = r"""#!/bin/bash
#SBATCH --ntasks=1
#SBATCH --nodes=1
#SBATCH --requeue
#SBATCH --open-mode=append
# Adds the parts of a render, when all are done. Written by crt slurm; submit.sh submits it.
set -u
missing=() films=()
for ((part = 0; part < {count}; ++part)); do
    film={parts}/$part.whole.crtfilm
    if [[ -e $film ]]; then films+=("$film"); else missing+=("$part"); fi
done
if ((${{#missing[@]}})); then
    echo "crt slurm: error: not done: ${{missing[*]}} of {count} parts; their logs lie in" {logs} >&2
    echo "submit what is missing with" {submit} >&2
    exit 5
fi
exec {crt} merge {outputs} "${{films[@]}}"
"""

SUBMIT = r"""#!/bin/bash
# Submits the parts of a render that are not done, and the job that adds all. Written by crt slurm.
set -euo pipefail
folder={folder}
jobs=$folder/jobs
if [[ -e $jobs ]] && [[ -n $(squeue --noheader --states=all --format='%T' --jobs="$(cat -- "$jobs")" \
        2>/dev/null | grep -vE 'COMPLETED|FAILED|CANCELLED|TIMEOUT|NODE_FAIL|BOOT_FAIL|DEADLINE|OUT_OF_ME' \
        || true) ]]; then
    echo "crt slurm: error: the jobs $(cat -- "$jobs") of this render still exist; scancel ends them" >&2
    exit 2
fi
missing=()
for ((part = 0; part < {count}; ++part)); do
    [[ -e $folder/parts/$part.whole.crtfilm ]] || missing+=("$part")
done
after=() submitted=
if ((${{#missing[@]}})); then
    list=$(IFS=,; echo "${{missing[*]}}")
    array=$(sbatch --parsable --job-name={name} --array="$list%{nodes}" --output={part_log} {part_options} \
        "$folder/render.sbatch")
    array=${{array%%;*}}
    after=(--dependency="afterany:$array")  # Also after a part that failed: the job says which.
    submitted=$array,
    echo "$array" >"$jobs"
    echo "job $array: ${{#missing[@]}} of {count} parts"
fi
merge=$(sbatch --parsable --job-name={name}-merge "${{after[@]}}" --output={merge_log} {merge_options} \
    "$folder/merge.sbatch")
merge=${{merge%%;*}}
echo "$submitted$merge" >"$jobs"
echo "job $merge: adds them"
"""


def quoted(words):
    return " ".join(shlex.quote(str(word)) for word in words)


def render_script(folder, crt, scene, ranges, options, every):
    """`ranges` are pairs of samples, `options` words for crt render."""
    return RENDER.format(crt=quoted([crt]), parts=quoted([folder / "parts"]), scene=quoted([scene]),
                         ranges=" ".join(f"{first}:{end}" for first, end in ranges), options=quoted(options),
                         every=quoted([every]))


def merge_script(folder, crt, count, outputs):
    return MERGE.format(crt=quoted([crt]), count=count, parts=quoted([folder / "parts"]),
                        logs=quoted([folder / "logs"]), submit=quoted([folder / "submit.sh"]),
                        outputs=quoted([word for output in outputs for word in ("-o", output)]))


def submit_script(folder, name, count, nodes, part_options, merge_options):
    logs = str(folder / "logs").replace("%", "%%")  # In sbatch's patterns % stands for something.
    return SUBMIT.format(folder=quoted([folder]), name=quoted([name]), count=count, nodes=nodes,
                         part_log=quoted([f"{logs}/%a.log"]), merge_log=quoted([f"{logs}/merge.log"]),
                         part_options=quoted(part_options), merge_options=quoted(merge_options))
