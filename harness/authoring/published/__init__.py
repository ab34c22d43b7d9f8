"""ObjectFolder's published files read into folders of ours; ``container`` alone needs torch for it."""
