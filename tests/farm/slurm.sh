#!/bin/bash
# A Slurm array: a sequence in 8 parts. For example:
#   sbatch --array=0-7 slurm.sh nave --path walk.json -o 'walk.####.png'
#SBATCH --job-name=hbao
#SBATCH --array=0-7
exec "${HBAO:-hbao}" sequence "$@" --chunk "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"
